#include "host/files/text_rows.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "drivers/system/next_line.hpp"
#include "host/files/sequence_header.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;
using Fields = std::vector<std::string>;

/// All rows of a text, and whether its numbers had decimal commas.
std::pair<std::vector<Fields>, bool> rows_of(const std::string& text) {
  const Scratch scratch;
  auto rows = TextRows::open(scratch.file("t.csv", text));
  EXPECT_TRUE(rows);
  std::vector<Fields> out;
  while (const auto row = rows->next()) out.push_back(row->fields);
  return {out, rows->decimal_commas()};
}

TEST(TextRows, SeparatorsAreThoseOfTheLine) {
  for (const char* text : {"1,2.5,x y", "1;2.5;x y", "1\t2.5\tx y", "1, 2.5 , x y\r\n", "\"1\",\"2.5\",\"x y\"",
                           "1,\t2.5,\tx y", "\n\n1;2,5;x y", "sep=;\r\n1;2,5;x y"}) {
    const auto [rows, commas] = rows_of(text);
    ASSERT_EQ(rows.size(), 1U) << text;
    EXPECT_EQ(rows[0], (Fields{"1", "2.5", "x y"})) << text;
  }
  EXPECT_EQ(rows_of("  1   2.5\t").first[0], (Fields{"1   2.5", ""}));
  EXPECT_EQ(rows_of("  1   2.5  ").first[0], (Fields{"1", "2.5"}));
  EXPECT_EQ(rows_of("1,,2,").first[0], (Fields{"1", "", "2", ""}));
}

TEST(TextRows, DecimalCommasAreReadWhereNoCommaSeparates) {
  EXPECT_TRUE(rows_of("1,5;-2,5e3;x").second);
  EXPECT_EQ(rows_of("1,5;-2,5e3;x").first[0], (Fields{"1.5", "-2.5e3", "x"}));
  EXPECT_EQ(rows_of("\"1,5\",\"2,25\"").first[0], (Fields{"1.5", "2.25"}));
  EXPECT_EQ(rows_of("1,5;1,2,3;a,b;3.5,2").first[0], (Fields{"1.5", "1,2,3", "a,b", "3.5,2"}));
  EXPECT_FALSE(rows_of("1,5\n").second);
}

TEST(TextRows, RemarksKeepTheirFieldsAndTheMarkOfUtf8IsPassedOver) {
  const Scratch scratch;
  auto rows = TextRows::open(scratch.file("t.csv", "\xEF\xBB\xBF# a,b\r\n1,2\r\n"));
  ASSERT_TRUE(rows);
  const auto remark = rows->next();
  EXPECT_TRUE(remark->remark);
  EXPECT_EQ(remark->fields, (Fields{"a", "b"}));
  const auto row = rows->next();
  EXPECT_EQ(row->line, 2U);
  EXPECT_EQ(row->fields, (Fields{"1", "2"}));
  EXPECT_FALSE(rows->next());
}

TEST(NextLine, IsAsGetlineHasItAndNoLongerThanMayBe) {
  for (const std::string text : {"", "\n", "a", "a\n", "a\n\nbc", "\na\n"}) {
    std::istringstream one(text), other(text);
    std::string line, expected;
    while (std::getline(other, expected)) {
      ASSERT_TRUE(next_line(one, line, 2)) << text;
      EXPECT_EQ(line, expected);
      EXPECT_EQ(one.eof(), other.eof()) << text;
    }
    EXPECT_FALSE(next_line(one, line, 2)) << text;
    EXPECT_TRUE(one.eof());
  }
  std::istringstream in("abc\nd");
  std::string line;
  EXPECT_FALSE(next_line(in, line, 2));
  EXPECT_FALSE(in.eof()) << "it is longer, and not the end";
  EXPECT_FALSE(next_line(in, line, 2));
}

/// What a file on a damaged disk does: some of it comes, then an error.
class Damaged : public std::filebuf {
 public:
  explicit Damaged(std::string text) : text_(std::move(text)) {
    setg(text_.data(), text_.data(), text_.data() + text_.size());
  }

 private:
  int_type underflow() override { throw std::ios::failure("basic_filebuf::underflow error reading the file"); }
  std::string text_;
};

TEST(NextLine, LeavesTheStreamBadWhereTheFileCannotBeReadFurther) {
  Damaged damaged("a\nb");
  std::istream in(&damaged);
  std::string line;
  ASSERT_TRUE(next_line(in, line, 9));
  EXPECT_EQ(line, "a");
  EXPECT_FALSE(next_line(in, line, 9));
  EXPECT_TRUE(in.bad());
  EXPECT_FALSE(next_line(in, line, 9));
}

/// Nothing of this process's memory is at 0: the file opens, and a read gives an error.
TEST(TextRows, NamesAFileThatCannotBeReadToItsEnd) {
  const std::string words = "/proc/self/mem: cannot be read to its end; check its disk";
  const auto rows = TextRows::open("/proc/self/mem");
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().what.find(words), 0U) << rows.error().what;
  const auto header = read_sequence_header("/proc/self/mem");
  ASSERT_FALSE(header);
  EXPECT_EQ(header.error().what.find(words), 0U) << header.error().what;
}

TEST(SequenceHeader, IsReadUpToItsBoundsAndRefusedBeyond) {
  const Scratch scratch;
  std::string text = "ObjectType = Image\n";
  for (int i = 0; i < 4; ++i) text += fmt::format("Seq_Frame{:04}_Timestamp = {}\nSeq_Frame{:04}_X = 1\n", i, i, i);
  text += "ElementDataFile = LOCAL\n";
  const std::string path = scratch.file("long.igs.mha", text);
  const auto all = read_sequence_header(path);
  ASSERT_TRUE(all) << all.error().what;
  EXPECT_EQ(all->frames.size(), 4U);
  EXPECT_TRUE(all->whole);
  EXPECT_TRUE(read_sequence_header(path, {10, text.size()}));
  for (const HeaderBounds& most : {HeaderBounds{9, text.size()}, HeaderBounds{10, text.size() - 1}}) {
    const auto header = read_sequence_header(path, most);
    ASSERT_FALSE(header);
    EXPECT_EQ(header.error().what.find(path + ": its header has more than the "), 0U) << header.error().what;
    EXPECT_NE(header.error().what.find("divide the recording into shorter ones"), std::string::npos);
  }
  // What is read of a recording of an hour, 100 frames a second with 20 fields each.
  EXPECT_GE(HeaderBounds().fields, 3600U * 100 * 20);
}

TEST(TextRows, RefusesUtf16AndWhatIsNotThere) {
  const Scratch scratch;
  const auto wide = TextRows::open(scratch.file("w.csv", "\xFF\xFEt\0"));
  ASSERT_FALSE(wide);
  EXPECT_NE(wide.error().what.find("UTF-8"), std::string::npos);
  EXPECT_FALSE(TextRows::open(scratch / "no.csv"));
  EXPECT_FALSE(TextRows::open(scratch.path()));
}

TEST(TextRows, RefusesALineWithoutEndAndATableWithoutEnd) {
  const Scratch scratch;
  const std::string megabyte(std::size_t{1} << 20U, '1');
  const auto endless = TextRows::open(scratch.file("e.csv", "a,b\n1,2\n" + megabyte + "1"));
  ASSERT_FALSE(endless);
  EXPECT_NE(endless.error().what.find("e.csv: line 3 is longer"), std::string::npos) << endless.error().what;

  const std::string ends(4'000'001, '\n');
  const auto long_table = TextRows::open(scratch.file("l.csv", ends));
  ASSERT_FALSE(long_table);
  EXPECT_NE(long_table.error().what.find("l.csv: has more than 4000000 lines"), std::string::npos)
      << long_table.error().what;

  std::string table = "\xEF\xBB\xBF# a,b\n";
  std::size_t count = 0;
  for (; table.size() < 3 * megabyte.size(); ++count) table += "1,2\n";
  auto rows = TextRows::open(scratch.file("t.csv", table));
  ASSERT_TRUE(rows) << rows.error().what;
  ASSERT_TRUE(rows->next()->remark);
  while (rows->next()) --count;
  EXPECT_EQ(count, 0U);
}

}  // namespace
}  // namespace birdseye::host
