#include "drivers/identity/public_key.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace birdseye {
namespace {

struct Vector {
  const char *key, *message, *signature;
};
// RFC 8032, section 7.1, tests 1 to 3.
constexpr Vector kVectors[] = {
    {"d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a", "",
     "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24"
     "655141438e7a100b"},
    {"3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
     "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aee"
     "b00d291612bb0c00"},
    {"fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
     "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed28d"
     "c027beceea1ec40a"}};

TEST(PublicKey, VerifiesThePublishedVectorsAndNothingThatDiffersByABit) {
  for (const Vector& vector : kVectors) {
    const auto key = PublicKey::of_hex(vector.key);
    ASSERT_TRUE(key);
    std::vector<std::uint8_t> message(std::string_view(vector.message).size() / 2);
    Signature signature{};
    ASSERT_TRUE(bytes_of_hex(vector.message, message) && bytes_of_hex(vector.signature, signature));
    EXPECT_TRUE(verify(*key, message, signature));
    for (std::size_t bit = 0; bit < 8 * signature.size(); ++bit) {
      Signature changed = signature;
      changed[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      EXPECT_FALSE(verify(*key, message, changed)) << bit;
    }
    for (std::size_t bit = 0; bit < 8 * key->bytes.size(); ++bit) {
      PublicKey other = *key;
      other.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      EXPECT_FALSE(verify(other, message, signature)) << bit;
    }
    message.push_back(0);
    EXPECT_FALSE(verify(*key, message, signature));
  }
}

TEST(PublicKey, IsReadFromItsDigitsAndFromNothingElse) {
  const std::string hex = kVectors[0].key;
  ASSERT_TRUE(PublicKey::of_hex(hex));
  EXPECT_EQ(PublicKey::of_hex(hex)->hex(), hex);
  std::string upper = hex, no_digit = hex, space = hex;
  ASSERT_EQ(hex[0], 'd');
  upper[0] = 'D';
  no_digit[0] = 'g';
  space[0] = ' ';
  EXPECT_EQ(*PublicKey::of_hex(upper), *PublicKey::of_hex(hex));
  for (const std::string& wrong : {std::string(), hex.substr(1), hex + "0", no_digit, space})
    EXPECT_FALSE(PublicKey::of_hex(wrong)) << wrong;
}

TEST(PublicKey, HasTheFingerprintThatSha256sumShows) {
  // printf d75a..511a | xxd -r -p | sha256sum
  EXPECT_EQ(PublicKey::of_hex(kVectors[0].key)->fingerprint(), "21fe 31df a154 a261 626b f854 046f d227");
}

}  // namespace
}  // namespace birdseye
