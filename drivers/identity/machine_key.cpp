#include "drivers/identity/machine_key.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <new>
#include <system_error>

#include "drivers/identity/identity_folder.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/unique_fd.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye {

namespace {

namespace fs = std::filesystem;

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;

constexpr const char* kFile = "key.pem";
constexpr std::size_t kMostBytes = 4096;  // of a key's file: one of Ed25519 has 119

std::shared_ptr<EVP_PKEY> owned(EVP_PKEY* key) {
  return {key, &EVP_PKEY_free};
}

Error cannot(const fs::path& path, const char* what) {
  return {Errc::unreadable,
          fmt::format("{}: {} ({}); check the folder and its permissions, or set BIRDSEYE_IDENTITY to another folder",
                      path.string(), what, std::strerror(errno))};
}

/// Whatever it is: of a link, whether the link is there.
bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

/// That the folder is one, and its owner's alone.
Result<void> check_folder(const fs::path& folder) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0) return cannot(folder, "cannot be read");
  if (!S_ISDIR(status.st_mode)) {
    return Error{Errc::bad_value, fmt::format("{}: is no folder, and this machine's key lies in one; set "
                                              "BIRDSEYE_IDENTITY to a folder",
                                              folder.string())};
  }
  if (auto checked = check_owner(folder, status); !checked) return checked;
  if ((status.st_mode & (S_IWGRP | S_IWOTH)) == 0) return {};
  return Error{Errc::bad_value, fmt::format("{}: others than its owner may change the keys in it: chmod 700 {}",
                                            folder.string(), folder.string())};
}

/// The same, and the folder is made where there is none.
Result<void> own_folder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) {
    if (auto made = make_folder_durably(folder); !made) return made;
    if (::chmod(folder.c_str(), S_IRWXU) != 0) return cannot(folder, "cannot be made its owner's alone");
  }
  return check_folder(folder);
}

/// That a file could be made, and the folders above it that are not there.
Result<void> check_makeable(const fs::path& file) {
  fs::path above = fs::absolute(file).parent_path();
  std::error_code ignored;
  while (!fs::exists(above, ignored) && above.has_relative_path()) above = above.parent_path();
  if (::access(above.c_str(), W_OK | X_OK) == 0) return {};
  return cannot(file, "cannot be made");
}

bool write_all(int fd, std::span<const char> bytes) {
  while (!bytes.empty()) {
    const auto written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return true;
}

std::shared_ptr<EVP_PKEY> new_key() {
  auto key = owned(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"));
  if (!key) throw std::bad_alloc();
  return key;
}

PublicKey public_half_of(EVP_PKEY* key) {
  PublicKey out;
  std::size_t size = out.bytes.size();
  if (EVP_PKEY_get_raw_public_key(key, out.bytes.data(), &size) != 1) throw std::bad_alloc();
  return out;
}

/// Makes a key and puts it in its place, unless another program was first: then that one's stays.
Result<void> make_key(const fs::path& file) {
  const auto key = new_key();
  const Bio text(BIO_new(BIO_s_secmem()), &BIO_free);
  if (!text || PEM_write_bio_PKCS8PrivateKey(text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1)
    throw std::bad_alloc();
  char* begin = nullptr;
  const auto size = static_cast<std::size_t>(BIO_get_mem_data(text.get(), &begin));
  std::string part = file.string() + "-XXXXXX";
  {
    const UniqueFd fd(::mkstemp(part.data()));  // for its owner alone
    if (!fd) return cannot(file, "cannot be made");
    if (!write_all(fd.get(), {begin, size})) {
      auto error = cannot(file, "cannot be written");
      ::unlink(part.c_str());
      return error;
    }
  }
  auto placed = sync_file(part);
  if (placed && ::link(part.c_str(), file.c_str()) != 0 && errno != EEXIST) placed = cannot(file, "cannot be made");
  ::unlink(part.c_str());
  return placed ? sync_folder(file.parent_path()) : placed;
}

/// A key with a password is none that a service could use: nobody is asked.
int no_password(char* /*to*/, int /*size*/, int /*writing*/, void* /*user*/) {
  return -1;
}

Result<std::shared_ptr<EVP_PKEY>> read_key(const fs::path& file) {
  const auto fd = open_file(file);
  if (!fd) return fd.error();
  struct stat status {};
  if (::fstat(fd->get(), &status) != 0) return cannot(file, "cannot be read");
  if (const auto checked = check_owner(file, status); !checked) return checked.error();
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return Error{
        Errc::bad_value,
        fmt::format("{}: others than its owner may read this machine's key: chmod 600 {}; if somebody may have "
                    "read it, remove it, and another is made",
                    file.string(), file.string())};
  }
  std::array<char, kMostBytes> bytes{};
  const auto size = ::read(fd->get(), bytes.data(), bytes.size());
  if (size < 0) return cannot(file, "cannot be read");
  const Bio text(BIO_new_mem_buf(bytes.data(), static_cast<int>(size)), &BIO_free);
  auto key = owned(text ? PEM_read_bio_PrivateKey(text.get(), nullptr, &no_password, nullptr) : nullptr);
  OPENSSL_cleanse(bytes.data(), bytes.size());
  ERR_clear_error();
  if (key && EVP_PKEY_get_id(key.get()) == EVP_PKEY_ED25519) return key;
  return Error{Errc::bad_format,
               fmt::format("{}: is no key of Ed25519 without a password, in PEM; remove it, and another is made: what "
                           "the former one signed is then of an unknown machine",
                           file.string())};
}

}  // namespace

Result<MachineKey> MachineKey::open(const fs::path& folder) {
  if (auto own = own_folder(folder); !own) return own.error();
  const fs::path file = folder / kFile;
  if (!is_there(file)) {
    if (auto made = make_key(file); !made) return made.error();
  }
  auto key = read_key(file);
  if (!key) return key.error();
  const PublicKey public_key = public_half_of(key->get());
  return MachineKey(*std::move(key), public_key, file);
}

Result<std::optional<MachineKey>> MachineKey::look(const fs::path& folder) {
  if (is_there(folder)) {
    if (auto checked = check_folder(folder); !checked) return checked.error();
  }
  if (!is_there(folder / kFile)) {
    if (auto checked = check_makeable(folder / kFile); !checked) return checked.error();
    return std::optional<MachineKey>();
  }
  auto key = open(folder);
  if (!key) return key.error();
  return std::optional<MachineKey>(*std::move(key));
}

MachineKey MachineKey::for_once() {
  auto key = new_key();
  const PublicKey public_key = public_half_of(key.get());
  return {std::move(key), public_key, {}};
}

Signature MachineKey::sign(std::span<const std::uint8_t> bytes) const {
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  Signature signature{};
  std::size_t size = signature.size();
  if (!context || EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key_.get()) != 1 ||
      EVP_DigestSign(context.get(), signature.data(), &size, bytes.data(), bytes.size()) != 1)
    throw std::bad_alloc();
  return signature;
}

std::string machine_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return machine_word("");
  return machine_word(name.data());
}

std::string machine_word(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c <= ' ' || c >= 127; }, '_');
  constexpr std::size_t kMost = 64;
  return name.empty() ? "unnamed" : name.substr(0, kMost);
}

}  // namespace birdseye
