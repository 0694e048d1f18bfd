#include "drivers/identity/machine_key.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <stdlib.h>
#include <unistd.h>

#include <optional>
#include <thread>
#include <vector>

#include "drivers/identity/identity_folder.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;

using testing::Scratch;

constexpr fs::perms kOwnerReadsAndWrites = fs::perms::owner_read | fs::perms::owner_write;

/// The file of a key whose secret half is these digits, as RFC 8410 has it.
std::string pem_of(const std::string& secret) {
  std::vector<std::uint8_t> der(16 + secret.size() / 2);
  EXPECT_TRUE(bytes_of_hex("302e020100300506032b657004220420" + secret, der));
  std::string base64(65, '\0');
  base64.resize(
      static_cast<std::size_t>(EVP_EncodeBlock(reinterpret_cast<unsigned char*>(base64.data()), der.data(), 48)));
  return "-----BEGIN PRIVATE KEY-----\n" + base64 + "\n-----END PRIVATE KEY-----\n";
}

void put_key(const Scratch& folder, const std::string& text) {
  (void)folder.file("key.pem", text);
  fs::permissions(folder / "key.pem", kOwnerReadsAndWrites);
}

std::string error_of(const fs::path& folder) {
  const auto key = MachineKey::open(folder);
  return key ? "" : key.error().what;
}

TEST(MachineKey, SignsAsPublished) {
  // RFC 8032, section 7.1, tests 2 and 3.
  const char* const vectors[][4] = {
      {"4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
       "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
       "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb430"
       "2aeeb00d291612bb0c00"},
      {"c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
       "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
       "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716e"
       "d28dc027beceea1ec40a"}};
  for (const auto& [secret, public_key, message, signature] : vectors) {
    const Scratch folder;
    put_key(folder, pem_of(secret));
    const auto key = MachineKey::open(folder.path());
    ASSERT_TRUE(key) << key.error().what;
    EXPECT_EQ(key->public_key().hex(), public_key);
    std::vector<std::uint8_t> bytes(std::string_view(message).size() / 2);
    ASSERT_TRUE(bytes_of_hex(message, bytes));
    EXPECT_EQ(hex_of(key->sign(bytes)), signature);
  }
}

TEST(MachineKey, IsMadeOnceAndForItsOwnerAlone) {
  const Scratch scratch;
  const fs::path folder = scratch / "a/identity";
  testing::forget_synced();
  const auto made = MachineKey::open(folder);
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(fs::status(folder).permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::status(folder / "key.pem").permissions(), kOwnerReadsAndWrites);
  EXPECT_TRUE(testing::is_synced(folder / "key.pem"));
  EXPECT_TRUE(testing::is_synced(folder));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << "nothing is left beside it";
  EXPECT_EQ(made->file(), folder / "key.pem");
  const std::string text = testing::contents_of(made->file());
  EXPECT_TRUE(text.starts_with("-----BEGIN PRIVATE KEY-----\n")) << text;

  const auto read = MachineKey::open(folder);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->public_key(), made->public_key());
  const std::uint8_t message[] = {1, 2, 3};
  EXPECT_TRUE(verify(made->public_key(), message, read->sign(message)));
  const auto other = MachineKey::open(scratch / "b");
  ASSERT_TRUE(other);
  EXPECT_NE(other->public_key(), made->public_key());
  EXPECT_FALSE(verify(other->public_key(), message, read->sign(message)));
}

TEST(MachineKey, ALookMakesNone) {
  const Scratch scratch;
  const fs::path folder = scratch / "a/identity";
  const auto none = MachineKey::look(folder);
  ASSERT_TRUE(none) << none.error().what;
  EXPECT_FALSE(*none);
  EXPECT_FALSE(fs::exists(scratch / "a"));
  const auto made = MachineKey::open(folder);
  ASSERT_TRUE(made);
  const auto seen = MachineKey::look(folder);
  ASSERT_TRUE(seen && *seen);
  EXPECT_EQ((*seen)->public_key(), made->public_key());
}

TEST(MachineKey, ALookFindsFaultWithWhatIsThereAndWithWhatCouldNotBeMade) {
  const Scratch scratch;
  const auto look_error = [](const fs::path& folder) {
    const auto seen = MachineKey::look(folder);
    return seen ? "" : seen.error().what;
  };
  ASSERT_TRUE(MachineKey::open(scratch / "identity"));
  fs::permissions(scratch / "identity/key.pem", fs::perms::others_read, fs::perm_options::add);
  EXPECT_NE(look_error(scratch / "identity").find("key.pem: others than its owner may read"), std::string::npos)
      << look_error(scratch / "identity");
  fs::permissions(scratch / "identity", fs::perms::others_write, fs::perm_options::add);
  EXPECT_NE(look_error(scratch / "identity").find("identity: others than its owner may change"), std::string::npos)
      << look_error(scratch / "identity");
  const fs::path in_a_file = scratch.file("file", "");
  EXPECT_NE(look_error(in_a_file / "identity").find("key.pem: cannot be made"), std::string::npos)
      << look_error(in_a_file / "identity");
}

TEST(MachineKey, IsOneWhereSeveralProgramsMakeItAtOnce) {
  for (int round = 0; round < 20; ++round) {
    const Scratch scratch;
    std::vector<std::optional<PublicKey>> keys(4);
    std::vector<std::thread> programs;
    programs.reserve(keys.size());
    for (auto& key : keys) {
      programs.emplace_back([&] {
        const auto opened = MachineKey::open(scratch.path());
        if (opened) key = opened->public_key();
      });
    }
    for (std::thread& program : programs) program.join();
    for (const auto& key : keys) {
      ASSERT_TRUE(key);
      EXPECT_EQ(*key, *keys[0]);
    }
  }
}

TEST(MachineKey, IsRefusedWhereOthersMayReadItOrChangeItsFolder) {
  const Scratch scratch;
  ASSERT_TRUE(MachineKey::open(scratch.path()));
  for (const fs::perms more : {fs::perms::group_read, fs::perms::others_read, fs::perms::others_write}) {
    fs::permissions(scratch / "key.pem", kOwnerReadsAndWrites | more);
    EXPECT_NE(error_of(scratch.path()).find("key.pem: others than its owner may read"), std::string::npos);
    EXPECT_NE(error_of(scratch.path()).find("chmod 600 " + (scratch / "key.pem").string()), std::string::npos);
  }
  fs::permissions(scratch / "key.pem", kOwnerReadsAndWrites);
  EXPECT_EQ(error_of(scratch.path()), "");
  for (const fs::perms more : {fs::perms::group_write, fs::perms::others_write}) {
    fs::permissions(scratch.path(), fs::perms::owner_all | more);
    EXPECT_NE(error_of(scratch.path()).find("chmod 700 " + scratch.path().string()), std::string::npos);
  }
}

TEST(MachineKey, IsRefusedWhereItOrItsFolderIsAnotherUsers) {
  for (const char* name : {"key.pem", ""}) {
    const Scratch scratch;
    ASSERT_TRUE(MachineKey::open(scratch.path()));
    const fs::path path = *name != '\0' ? scratch / name : scratch.path();
    if (::chown(path.c_str(), 12345, static_cast<gid_t>(-1)) != 0) GTEST_SKIP() << "only root gives files away";
    const std::string error = error_of(scratch.path());
    EXPECT_EQ(error.find(path.string() + ": belongs to another user (12345)"), 0U) << error;
    EXPECT_NE(error.find("chown 0 " + path.string()), std::string::npos) << error;
  }
}

TEST(MachineKey, RefusesAFileThatIsNoKeyOfItsKind) {
  const std::string sound = pem_of("4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb");
  std::string x25519 = pem_of("4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb");
  x25519.replace(x25519.find("AwBQYDK2Vw"), 10, "AwBQYDK2Vu");
  for (const std::string& text : {std::string(), std::string("hello\n"), sound.substr(0, 60), x25519}) {
    const Scratch folder;
    put_key(folder, text);
    EXPECT_NE(error_of(folder.path()).find("key.pem: is no key of Ed25519"), std::string::npos) << text;
    EXPECT_EQ(testing::contents_of(folder / "key.pem"), text) << "and is left as it is";
  }
}

TEST(MachineKey, APipeInItsPlaceIsNotWaitedFor) {
  const Scratch folder;
  ASSERT_EQ(::mkfifo((folder / "key.pem").c_str(), 0600), 0);
  EXPECT_NE(error_of(folder.path()).find("key.pem: is no file but a pipe"), std::string::npos)
      << error_of(folder.path());
}

TEST(MachineKey, NamesAFolderThatCannotBe) {
  const Scratch scratch;
  EXPECT_NE(error_of(scratch.file("file", "") + "/identity").find("/file/identity: "), std::string::npos);
  for (const std::string& no_folder : {std::string("/dev/null"), scratch.file("other", "")}) {
    const std::string error = error_of(no_folder);
    EXPECT_EQ(error.find(no_folder + ": is no folder"), 0U) << error;
    EXPECT_EQ(error.find("chmod"), std::string::npos) << error;
  }
}

/// The environment as a test needs it, and afterwards as it was.
class Environment {
 public:
  explicit Environment(const std::vector<std::pair<std::string, std::string>>& values) {
    for (const char* name : {"BIRDSEYE_IDENTITY", "STATE_DIRECTORY", "XDG_CONFIG_HOME", "HOME"}) {
      const char* const was = ::getenv(name);
      was_.emplace_back(name, was != nullptr ? std::optional<std::string>(was) : std::nullopt);
      ::unsetenv(name);
    }
    for (const auto& [name, value] : values) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~Environment() {
    for (const auto& [name, value] : was_) {
      if (value) {
        ::setenv(name.c_str(), value->c_str(), 1);
      } else {
        ::unsetenv(name.c_str());
      }
    }
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  std::vector<std::pair<std::string, std::optional<std::string>>> was_;
};

TEST(IdentityFolder, IsWhatTheEnvironmentSays) {
  const std::pair<std::string, std::string> given{"BIRDSEYE_IDENTITY", "/g"}, state{"STATE_DIRECTORY", "/s:/t"},
      config{"XDG_CONFIG_HOME", "/c"}, home{"HOME", "/h"};
  const auto folder = [](const std::vector<std::pair<std::string, std::string>>& values) {
    const Environment environment(values);
    const auto found = identity_folder();
    return found ? found->string() : found.error().what;
  };
  EXPECT_EQ(folder({given, state, config, home}), "/g");
  EXPECT_EQ(folder({state, config, home}), "/s/identity");
  EXPECT_EQ(folder({config, home}), "/c/birdseye/identity");
  EXPECT_EQ(folder({home}), "/h/.config/birdseye/identity");
  EXPECT_NE(folder({}).find("set BIRDSEYE_IDENTITY to a folder"), std::string::npos);
}

TEST(MachineName, IsAWord) {
  EXPECT_FALSE(machine_name().empty());
  EXPECT_EQ(machine_name().find_first_of(" \t\n"), std::string::npos);
}

}  // namespace
}  // namespace birdseye
