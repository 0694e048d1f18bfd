#include "hw-sim/local/local_disk.hpp"

#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>

#include "drivers/system/durable.hpp"
#include "hw-sim/time/virtual_time.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
}

/// A folder of such a disk, on which this thread's programs write.
struct OnTheDisk {
  explicit OnTheDisk(std::uint64_t seed) {
    fs::create_directories(root);
    disk.emplace(root, seed);
    DiskKeeper::put(&*disk);
  }
  ~OnTheDisk() { DiskKeeper::put(nullptr); }
  OnTheDisk(const OnTheDisk&) = delete;
  OnTheDisk& operator=(const OnTheDisk&) = delete;

  testing::Scratch scratch;
  fs::path root = scratch.path() / "root", file = root / "file", part = root / "file.part";
  std::optional<LocalDisk> disk;
};

/// What file has after a power cut, by so many seeds; "gone": it is not there.
template <typename Work>
std::set<std::string> left_after(const Work& work) {
  std::set<std::string> left;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    OnTheDisk on(seed);
    work(on);
    EXPECT_TRUE(on.disk->power_up());
    left.insert(fs::exists(on.file) ? testing::contents_of(on.file) : "gone");
  }
  return left;
}

TEST(LocalDisk, WhatWasSyncedWithItsNameIsThere) {
  EXPECT_EQ(left_after([](OnTheDisk& on) {
              write(on.file, "old");
              ASSERT_TRUE(sync_file(on.file));
              ASSERT_TRUE(sync_folder(on.root));
            }),
            (std::set<std::string>{"old"}));
}

TEST(LocalDisk, ANameThatWasNotSyncedMayBeGone) {
  EXPECT_EQ(left_after([](OnTheDisk& on) {
              write(on.file, "new");
              ASSERT_TRUE(sync_file(on.file));
            }),
            (std::set<std::string>{"gone", "new"}));
}

TEST(LocalDisk, OfWhatWasNotSyncedAPartMayBeThere) {
  const auto left = left_after([](OnTheDisk& on) {
    write(on.file, "0123456789");
    ASSERT_TRUE(sync_folder(on.root));
  });
  EXPECT_GT(left.size(), 5U);
  EXPECT_FALSE(left.contains("gone"));
}

TEST(LocalDisk, WhatWasAppendedComesAfterWhatWasSynced) {
  for (const std::string& text : left_after([](OnTheDisk& on) {
         write(on.file, "synced");
         ASSERT_TRUE(sync_file(on.file));
         ASSERT_TRUE(sync_folder(on.root));
         std::ofstream(on.file, std::ios::app) << " and more";
       }))
    EXPECT_TRUE(text.starts_with("synced")) << text;
}

TEST(LocalDisk, WhatWasReplacedDurablyIsTheNewFile) {
  EXPECT_EQ(left_after([](OnTheDisk& on) {
              for (const char* text : {"old", "new"}) {
                write(on.part, text);
                ASSERT_TRUE(replace_durably(on.part, on.file));
              }
            }),
            (std::set<std::string>{"new"}));
}

TEST(LocalDisk, WhereThePowerGoesMeanwhileItIsTheOldOneOrTheNewOneAndWhole) {
  std::set<std::string> all;
  for (std::uint64_t syncs = 0; syncs <= 2; ++syncs) {
    all.merge(left_after([syncs](OnTheDisk& on) {
      write(on.part, "old");
      ASSERT_TRUE(replace_durably(on.part, on.file));
      on.disk->lose_power_after(syncs);
      write(on.part, "new");
      EXPECT_EQ(replace_durably(on.part, on.file).has_value(), syncs == 2);
      EXPECT_TRUE(on.disk->powerless());
    }));
  }
  EXPECT_EQ(all, (std::set<std::string>{"old", "new"}));
}

TEST(LocalDisk, AFileThatWasReplacedWithoutASyncMayBeTorn) {
  const auto left = left_after([](OnTheDisk& on) {
    write(on.file, "old");
    ASSERT_TRUE(sync_file(on.file));
    ASSERT_TRUE(sync_folder(on.root));
    write(on.part, "0123456789");
    fs::rename(on.part, on.file);
  });
  EXPECT_TRUE(left.contains("old"));
  EXPECT_GT(left.size(), 4U);
}

TEST(LocalDisk, WhatWasWrittenAfterThePowerWentIsLost) {
  EXPECT_EQ(left_after([](OnTheDisk& on) {
              on.disk->lose_power();
              write(on.file, "late");
              EXPECT_FALSE(sync_file(on.file));
              EXPECT_FALSE(sync_folder(on.root));
            }),
            (std::set<std::string>{"gone"}));
}

TEST(LocalDisk, WhatWasWrittenOverItIsTheFormerOrAPartOfTheNew) {
  const auto left = left_after([](OnTheDisk& on) {
    write(on.file, "former");
    ASSERT_TRUE(sync_file(on.file));
    ASSERT_TRUE(sync_folder(on.root));
    write(on.file, "0123456789");
  });
  EXPECT_TRUE(left.contains("former"));
  EXPECT_GT(left.size(), 4U);
  for (const std::string& text : left) EXPECT_LE(text.size(), 10U) << "no longer than it ever was";
}

TEST(LocalDisk, WhereAPartIsThereZerosMayFollow) {
  int zeros = 0;
  for (const std::string& text : left_after([](OnTheDisk& on) {
         write(on.file, "0123456789");
         ASSERT_TRUE(sync_folder(on.root));
       }))
    zeros += text.ends_with('\0') ? 1 : 0;
  EXPECT_GT(zeros, 0);
}

TEST(LocalDisk, ALateOneTakesItsTime) {
  const auto ran = run_in_virtual_time({.seed = 1}, [] {
    OnTheDisk on(1);
    write(on.file, "text");
    on.disk->set_late(Duration::from_ms(250));
    EXPECT_TRUE(sync_file(on.file));
  });
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_GE(ran->elapsed_ns, Duration::from_ms(250).ns);
}

TEST(LocalDisk, AFullOneFailsEachSyncAndSaysSo) {
  OnTheDisk on(1);
  write(on.file, "text");
  on.disk->set_full(true);
  const auto synced = sync_file(on.file);
  ASSERT_FALSE(synced);
  EXPECT_NE(synced.error().what.find("is it full"), std::string::npos) << synced.error().what;
  EXPECT_EQ(on.disk->failed(), 1U);
  on.disk->set_full(false);
  EXPECT_TRUE(sync_file(on.file));
}

TEST(LocalDisk, WhatLiesElsewhereIsNotItsOwn) {
  OnTheDisk on(1);
  on.disk->set_full(true);
  write(on.scratch.path() / "elsewhere", "text");
  EXPECT_TRUE(sync_file(on.scratch.path() / "elsewhere"));
}

}  // namespace
}  // namespace birdseye::hw_sim
