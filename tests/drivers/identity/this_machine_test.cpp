#include "drivers/identity/this_machine.hpp"

#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

constexpr const char* kKind = "a kind";
const std::string kSum(64, 'a');

TEST(ThisMachine, KnowsWhatItSignedAndNobodyElseUntilItIsTold) {
  const testing::Scratch scratch;
  auto one = ThisMachine::open(scratch / "one");
  const auto other = ThisMachine::open(scratch / "other");
  ASSERT_TRUE(one && other);
  const auto own = one->author_of(kKind, kSum, one->sign(kKind, kSum));
  ASSERT_TRUE(own) << own.error().what;
  EXPECT_EQ(own->standing, Author::Standing::known);
  EXPECT_EQ(own->machine, machine_name());
  EXPECT_EQ(one->author_of(kKind, kSum, std::nullopt)->standing, Author::Standing::nobody);

  const auto signature = other->sign(kKind, kSum);
  const auto before = one->author_of(kKind, kSum, signature);
  ASSERT_TRUE(before) << before.error().what;
  EXPECT_EQ(before->standing, Author::Standing::unknown);
  EXPECT_NE(before->words().find("not known here"), std::string::npos) << before->words();
  EXPECT_NE(before->words().find(other->key().public_key().fingerprint()), std::string::npos);
  ASSERT_TRUE(one->trust("cart-2", before->key));
  for (const auto& machine : {*one, *ThisMachine::open(scratch / "one")}) {
    const auto after = machine.author_of(kKind, kSum, signature);
    ASSERT_TRUE(after);
    EXPECT_EQ(after->standing, Author::Standing::known);
    EXPECT_NE(after->words().find("signed by cart-2 ("), std::string::npos) << after->words();
  }
}

TEST(ThisMachine, ASignatureIsOfItsFileItsKindItsWriterAndItsTimeAlone) {
  const ThisMachine machine = ThisMachine::for_once();
  const auto signature = machine.sign(kKind, kSum);
  const auto fits = [&](const char* kind, const std::string& sum, const calibration::FileSignature& by) {
    return machine.author_of(kind, sum, by).has_value();
  };
  EXPECT_TRUE(fits(kKind, kSum, signature));
  EXPECT_FALSE(fits("another kind", kSum, signature));
  EXPECT_FALSE(fits(kKind, std::string(64, 'b'), signature));
  for (std::string calibration::FileSignature::*const part :
       {&calibration::FileSignature::machine, &calibration::FileSignature::key, &calibration::FileSignature::utc,
        &calibration::FileSignature::signature}) {
    const std::string& as_it_is = signature.*part;
    for (std::size_t bit = 0; bit < 8 * as_it_is.size(); ++bit) {
      calibration::FileSignature changed = signature;
      char& c = (changed.*part)[bit / 8];
      c = static_cast<char>(c ^ (1 << bit % 8));
      // a and A are the same digit: the letter's case is no part of what a signature says.
      const bool same_digit =
          part == &calibration::FileSignature::signature && bit % 8 == 5 && as_it_is[bit / 8] >= 'a';
      EXPECT_EQ(fits(kKind, kSum, changed), same_digit) << c << " " << bit;
    }
  }
  const auto refused = machine.author_of(kKind, std::string(64, 'b'), signature);
  EXPECT_NE(refused.error().what.find("was changed since, or the signature is of another file"), std::string::npos);
}

TEST(ThisMachine, AnAuthorsNameIsAWordInALine) {
  const ThisMachine one = ThisMachine::for_once(), other = ThisMachine::for_once();
  calibration::FileSignature signature{"cart\n signed by you", other.key().public_key().hex(), "now\x1b[2J", ""};
  const std::string words = signed_words(kKind, kSum, signature);
  signature.signature = hex_of(other.key().sign({reinterpret_cast<const std::uint8_t*>(words.data()), words.size()}));
  const auto author = one.author_of(kKind, kSum, signature);
  ASSERT_TRUE(author) << author.error().what;
  EXPECT_EQ(author->machine, "cart__signed_by_you");
  EXPECT_EQ(author->utc, "now_[2J");
}

}  // namespace
}  // namespace birdseye
