#include "drivers/identity/public_key.hpp"

#include <openssl/evp.h>

#include <cstddef>
#include <memory>
#include <new>

namespace birdseye {

Result<PublicKey> PublicKey::of_hex(std::string_view text) {
  PublicKey key;
  if (bytes_of_hex(text, key.bytes)) return key;
  return Error{Errc::bad_format, "is no public key: 64 hexadecimal digits are needed"};
}

std::string PublicKey::fingerprint() const {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), nullptr, EVP_sha256(), nullptr) != 1)
    throw std::bad_alloc();
  std::string out;
  for (std::size_t i = 0; i < 16; i += 2) {
    if (i > 0) out += ' ';
    out += hex_of(std::span(digest).subspan(i, 2));
  }
  return out;
}

bool verify(const PublicKey& key, std::span<const std::uint8_t> bytes, const Signature& signature) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> pkey(
      EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, key.bytes.data(), key.bytes.size()), &EVP_PKEY_free);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  return pkey && context && EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, pkey.get()) == 1 &&
         EVP_DigestVerify(context.get(), signature.data(), signature.size(), bytes.data(), bytes.size()) == 1;
}

}  // namespace birdseye
