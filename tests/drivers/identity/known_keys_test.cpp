#include "drivers/identity/known_keys.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <memory>
#include <string>

#include "drivers/identity/followed_keys.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;

using testing::Scratch;

PublicKey key_of(std::uint8_t first) {
  PublicKey key;
  key.bytes[0] = first;
  return key;
}

const KnownKeys::Machine kOwn{"theatre-3", key_of(1)};

std::string error_of(const Scratch& folder) {
  const auto known = KnownKeys::read(folder.path(), kOwn);
  return known ? "" : known.error().what;
}

TEST(KnownKeys, KnowsItsOwnAndNoOtherWithoutAFile) {
  const Scratch folder;
  const auto known = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(known) << known.error().what;
  EXPECT_EQ(known->name_of(key_of(1)), "theatre-3");
  EXPECT_FALSE(known->name_of(key_of(2)));
  const auto of_nobody = KnownKeys::read(folder.path(), {});
  ASSERT_TRUE(of_nobody);
  EXPECT_FALSE(of_nobody->name_of(key_of(1)));
  EXPECT_FALSE(of_nobody->name_of(PublicKey{}));
}

TEST(KnownKeys, ReadsWhatWasAddedAndLeavesRemarks) {
  const Scratch folder;
  (void)folder.file("known", "# carts\n\ncart-1 " + key_of(2).hex());
  fs::permissions(folder / "known", fs::perms::owner_read | fs::perms::owner_write);
  auto known = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(known) << known.error().what;
  testing::forget_synced();
  ASSERT_TRUE(known->add("cart-2", key_of(3)));
  EXPECT_TRUE(testing::is_synced(folder / "known"));
  EXPECT_TRUE(testing::is_synced(folder.path()));
  EXPECT_EQ(testing::contents_of(folder / "known"),
            "# carts\n\ncart-1 " + key_of(2).hex() + "\ncart-2 " + key_of(3).hex() + "\n");
  const auto again = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(again) << again.error().what;
  for (const auto& names : {*known, *again}) {
    EXPECT_EQ(names.name_of(key_of(1)), "theatre-3");
    EXPECT_EQ(names.name_of(key_of(2)), "cart-1");
    EXPECT_EQ(names.name_of(key_of(3)), "cart-2");
    EXPECT_EQ(names.machines().size(), 3);
  }
}

TEST(KnownKeys, NothingIsWrittenThroughALinkBesideTheFile) {
  const Scratch folder;
  const std::string other = folder.file("other.txt", "another's");
  fs::create_symlink(other, folder / "known.part");
  auto known = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(known) << known.error().what;
  ASSERT_TRUE(known->add("cart-2", key_of(3)));
  EXPECT_EQ(testing::contents_of(other), "another's");
  EXPECT_TRUE(fs::is_symlink(folder / "known.part"));
  EXPECT_FALSE(fs::is_symlink(folder / "known"));
  EXPECT_EQ(fs::status(folder / "known").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST(KnownKeys, AddsNoKeyTwiceNoNameOfAnotherKeyAndNoNameThatIsNoWord) {
  const Scratch folder;
  auto known = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(known);
  ASSERT_TRUE(known->add("cart-1", key_of(2)));
  ASSERT_TRUE(known->add("another", key_of(2)));
  EXPECT_EQ(known->name_of(key_of(2)), "cart-1");
  for (const char* name : {"cart-1", "theatre-3"}) {
    const auto added = known->add(name, key_of(4));
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().what.find("another key has the name"), std::string::npos) << added.error().what;
  }
  const std::string too_long(KnownKeys::kMostNameBytes + 1, 'n');
  for (const char* name :
       {"", "two words", "line\nbreak", "#remark", "own", ".", "..", "../cart", "cart/1", too_long.c_str()}) {
    const auto added = known->add(name, key_of(4));
    ASSERT_FALSE(added) << name;
    EXPECT_NE(added.error().what.find("is no name of a machine: give one word"), std::string::npos) << name;
  }
  EXPECT_EQ(testing::contents_of(folder / "known"), "cart-1 " + key_of(2).hex() + "\n");
}

TEST(KnownKeys, OfTheLongestNameAFileCanBeMade) {
  const Scratch folder;
  auto known = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(known);
  const std::string longest(KnownKeys::kMostNameBytes, 'n');
  ASSERT_TRUE(known->add(longest, key_of(2)));
  (void)folder.file(longest + ".crt", "its certificate");
  EXPECT_EQ(testing::contents_of(folder / (longest + ".crt")), "its certificate");
  const std::string free = known->free_name(longest);
  EXPECT_TRUE(KnownKeys::is_name(free)) << free;
  EXPECT_TRUE(known->add(free, key_of(3)));
}

TEST(KnownKeys, RefusesADamagedLineByItsNumber) {
  const std::string hex = key_of(2).hex();
  for (const std::string& line :
       {std::string("cart-1"), "cart-1 " + hex.substr(1), "cart-1 x" + hex.substr(1), "cart-1 " + hex + " more"}) {
    const Scratch folder;
    (void)folder.file("known", "# carts\n" + line + "\ncart-2 " + key_of(3).hex() + "\n");
    fs::permissions(folder / "known", fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_NE(error_of(folder).find("known: line 2: "), std::string::npos) << line << ": " << error_of(folder);
  }
}

TEST(KnownKeys, RefusesALineWhoseNameNoOtherMachineMayHave) {
  for (const char* name : {"own", "..", "../cart"}) {
    const Scratch folder;
    (void)folder.file("known", std::string(name) + " " + key_of(2).hex() + "\n");
    fs::permissions(folder / "known", fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_NE(error_of(folder).find("known: line 1: \"" + std::string(name) + "\" is no name"), std::string::npos)
        << error_of(folder);
  }
}

TEST(KnownKeys, AnotherMachineMayHaveTheNameThatThisOneHas) {
  const Scratch folder;
  (void)folder.file("known", "theatre-3 " + key_of(2).hex() + "\ntheatre-3-2 " + key_of(3).hex() + "\n");
  fs::permissions(folder / "known", fs::perms::owner_read | fs::perms::owner_write);
  auto known = KnownKeys::read(folder.path(), kOwn);
  ASSERT_TRUE(known) << known.error().what;
  EXPECT_EQ(known->name_of(key_of(2)), "theatre-3");
  EXPECT_EQ(known->name_of(key_of(1)), "theatre-3-3");
  EXPECT_EQ(known->free_name("theatre-3"), "theatre-3-4");
  EXPECT_EQ(known->free_name("theatre-4"), "theatre-4");
  const auto refused = known->add("theatre-3", key_of(4));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("give another name, as theatre-3-4"), std::string::npos) << refused.error().what;
  ASSERT_TRUE(known->add("theatre-3-4", key_of(4)));
  EXPECT_TRUE(KnownKeys::read(folder.path(), kOwn));
}

TEST(KnownKeys, APipeInPlaceOfTheFileIsRefusedAndNotWaitedFor) {
  const Scratch folder;
  ASSERT_EQ(::mkfifo((folder / "known").c_str(), 0600), 0);
  EXPECT_NE(error_of(folder).find("known: is no file but a pipe"), std::string::npos) << error_of(folder);
}

TEST(KnownKeys, RefusesAFileThatOthersMayChange) {
  const Scratch folder;
  (void)folder.file("known", "cart-1 " + key_of(2).hex() + "\n");
  for (const fs::perms more : {fs::perms::group_write, fs::perms::others_write}) {
    fs::permissions(folder / "known", fs::perms::owner_read | fs::perms::owner_write | more);
    EXPECT_NE(error_of(folder).find("known: others than its owner may say"), std::string::npos) << error_of(folder);
  }
  fs::permissions(folder / "known", fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_read);
  EXPECT_EQ(error_of(folder), "");
}

TEST(KnownKeys, RefusesAFileOfAnotherUser) {
  const Scratch folder;
  const std::string path = folder.file("known", "cart-1 " + key_of(2).hex() + "\n");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  if (::chown(path.c_str(), 12345, static_cast<gid_t>(-1)) != 0) GTEST_SKIP() << "only root gives files away";
  EXPECT_NE(error_of(folder).find("known: belongs to another user (12345)"), std::string::npos) << error_of(folder);
  EXPECT_NE(error_of(folder).find("chown 0 " + path), std::string::npos) << error_of(folder);
}

class FollowedFile : public ::testing::Test {
 protected:
  void SetUp() override {
    say(line_of("cart-1", 2));
    auto opened = FollowedKeys::open(folder_.path(), kOwn);
    ASSERT_TRUE(opened) << opened.error().what;
    keys_ = *std::move(opened);
  }
  static std::string line_of(const std::string& name, std::uint8_t first) {
    return name + " " + key_of(first).hex() + "\n";
  }
  void say(const std::string& text) const {
    (void)folder_.file("known", text);
    fs::permissions(folder_ / "known", fs::perms::owner_read | fs::perms::owner_write);
  }

  Scratch folder_;
  std::unique_ptr<FollowedKeys> keys_;
};

TEST_F(FollowedFile, IsTakenAsItIsAtEachQuestion) {
  EXPECT_EQ(keys_->name_of(key_of(2)), "cart-1");
  say(line_of("cart-2", 3));
  EXPECT_EQ(keys_->name_of(key_of(3)), "cart-2");
  EXPECT_FALSE(keys_->name_of(key_of(2))) << "its line was taken out";
  fs::remove(folder_ / "known");
  EXPECT_FALSE(keys_->name_of(key_of(3)));
  EXPECT_EQ(keys_->name_of(key_of(1)), "theatre-3");
  EXPECT_EQ(keys_->fault(), "");
}

TEST_F(FollowedFile, ABadLinePutsNobodyOutAndIsTold) {
  say(line_of("cart-1", 2) + "theatre-3 KEY\n");
  EXPECT_EQ(keys_->name_of(key_of(2)), "cart-1");
  EXPECT_EQ(keys_->fault(),
            (folder_ / "known").string() + ": line 2: is no machine's name and key; mend or remove the line");
  say(line_of("cart-2", 3) + "theatre-3 KEY\n");
  EXPECT_FALSE(keys_->name_of(key_of(3))) << "nothing of a file that cannot be used lets anybody in";
  EXPECT_EQ(keys_->name_of(key_of(2)), "cart-1");
  say(line_of("cart-2", 3));
  EXPECT_EQ(keys_->fault(), "");
  EXPECT_EQ(keys_->name_of(key_of(3)), "cart-2");
  EXPECT_FALSE(keys_->name_of(key_of(2)));
}

TEST_F(FollowedFile, WhatWasReadToTellAFaultIsWhatIsKept) {
  say(line_of("cart-2", 3));
  EXPECT_EQ(keys_->fault(), "");
  say("theatre-3 KEY\n");
  EXPECT_EQ(keys_->name_of(key_of(3)), "cart-2");
}

TEST_F(FollowedFile, WhoeverMayWriteItLetsNobodyIn) {
  say(line_of("cart-2", 3));
  fs::permissions(folder_ / "known", fs::perms::others_write, fs::perm_options::add);
  EXPECT_FALSE(keys_->name_of(key_of(3)));
  EXPECT_EQ(keys_->name_of(key_of(2)), "cart-1");
  EXPECT_NE(keys_->fault().find("chmod 644"), std::string::npos) << keys_->fault();
}

/// A file that cannot be read is not one that is not there.
TEST_F(FollowedFile, OneThatCannotBeReachedPutsNobodyOutAndIsTold) {
  fs::remove(folder_ / "known");
  fs::create_symlink("known", folder_ / "known");  // to itself
  EXPECT_EQ(keys_->name_of(key_of(2)), "cart-1");
  EXPECT_NE(keys_->fault().find("known: cannot be read"), std::string::npos) << keys_->fault();
}

TEST_F(FollowedFile, IsRefusedWhereItCannotBeUsedToBeginWith) {
  say("theatre-3 KEY\n");
  EXPECT_FALSE(FollowedKeys::open(folder_.path(), kOwn));
}

}  // namespace
}  // namespace birdseye
