#include "host/volume/unread_form.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "host/volume/import.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::Scratch;

const std::string kVoxels(2 * 4 * 3 * 2, '\1');

std::string nrrd(const std::string& type = "short", const std::string& encoding = "raw",
                 const std::string& more = "endian: little\n") {
  return "NRRD0004\ntype: " + type + "\ndimension: 3\nspace: LPS\nsizes: 4 3 2\nencoding: " + encoding +
         "\nspace directions: (1,0,0) (0,1,0) (0,0,2)\nspace origin: (1,2,3)\n" + more;
}

const std::string kDigits = "1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1\n";

std::string with(std::string text, const std::string& old, const std::string& now) {
  return text.replace(text.find(old), old.size(), now);
}

std::string meta_image(const std::string& type = "MET_SHORT", const std::string& more = "",
                       const std::string& data = "LOCAL") {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n" + more +
         "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\nElementSpacing = 1 1 2\nDimSize = 4 3 2\nElementType "
         "= " +
         type + "\nElementDataFile = " + data + "\n";
}

std::string gzip(const std::string& bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string in = bytes, out(1000, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

/// A NIfTI-1 file, of a pair its header.
std::string nifti(std::int16_t datatype, std::int16_t bits, const char* magic = "n+1") {
  std::string file(352, '\0');
  const auto put = [&file](std::size_t at, auto value) { std::memcpy(file.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  for (std::size_t k = 0; k < 4; ++k) put(40 + 2 * k, static_cast<std::int16_t>(std::vector<int>{3, 4, 3, 2}[k]));
  put(70, datatype);
  put(72, bits);
  for (std::size_t at = 76; at < 92; at += 4) put(at, 1.0F);
  put(108, magic[1] == '+' ? 352.0F : 0.0F);
  file[123] = 2;
  put(252, std::int16_t{1});
  std::memcpy(file.data() + 344, magic, 4);
  return file;
}

/// A NIfTI-1 file with its voxels, of which one number of the header is another, at this byte of it.
template <typename Number>
std::string nifti_with(std::size_t at, Number number, const char* magic = "n+1") {
  std::string file = nifti(4, 16, magic);
  std::memcpy(file.data() + at, &number, sizeof number);
  return magic[1] == '+' ? file + kVoxels : file.substr(0, 348);
}

constexpr std::size_t kOffset = 108, kSlope = 112, kUnits = 123;  // bytes of a NIfTI header

std::string shifted(float slope, float intercept) {
  std::string file = nifti_with(kSlope, slope);
  std::memcpy(file.data() + kSlope + sizeof slope, &intercept, sizeof intercept);
  return file;
}

TEST(UnreadForm, AWholeFileThatIsNotReadIsToldByWhatItHolds) {
  const Scratch scratch;
  std::ofstream(scratch / "there.raw") << kVoxels;
  std::filesystem::create_directory(scratch / "below");
  std::ofstream(scratch / "below/there.raw") << kVoxels;
  std::ofstream(scratch / "pair.img") << kVoxels;
  std::ofstream(scratch / "zipped.img.gz") << gzip(kVoxels);
  struct Case {
    std::string name, text, why;  // why it is refused; empty: it is read
  };
  const std::string compressed = "CompressedData = True\n", packed = gzip(kVoxels);
  const std::string sized = fmt::format("{}CompressedDataSize = {}\n", compressed, packed.size());
  const std::string twice = gzip(kVoxels.substr(0, 24)) + gzip(kVoxels.substr(24));
  const std::string twice_sized = fmt::format("{}CompressedDataSize = {}\n", compressed, twice.size());
  for (const Case& c : std::vector<Case>{
           {"good.nrrd", nrrd() + "\n" + kVoxels, ""},
           {"beside.nhdr", nrrd() + "data file: there.raw\n\n", ""},
           {"bytes.nrrd", nrrd("uchar", "raw", "") + "\n" + kVoxels.substr(24), ""},
           {"more.nrrd", with(nrrd(), "4 3 2", "3 3 2") + "\n" + kVoxels, "holds 48 bytes of voxels or more, and the"},
           {"less.nrrd", with(nrrd(), "4 3 2", "5 3 2") + "\n" + kVoxels, "cut short or damaged"},
           {"padded.nrrd", nrrd() + "\n" + kVoxels + "\n", ""},
           {"more.nhdr", with(nrrd(), "4 3 2", "4 2 2") + "data file: there.raw\n\n",
            "and the size in its header is of 32"},
           {"skips.nhdr", with(nrrd(), "4 3 2", "4 2 2") + "byte skip: 16\ndata file: there.raw\n\n", ""},
           {"packed.nrrd", nrrd("short", "gzip") + "\n" + packed, ""},
           {"more_packed.nrrd", with(nrrd("short", "gzip"), "4 3 2", "4 3 1") + "\n" + packed,
            "a picture, not a volume"},
           {"packed_rows.nrrd", with(nrrd("short", "gzip"), "4 3 2", "4 2 2") + "\n" + packed, "is of 32"},
           {"twice_packed.nrrd", nrrd("short", "gzip") + "\n" + twice, ""},
           {"more_twice_packed.nrrd", with(nrrd("short", "gzip"), "4 3 2", "4 2 2") + "\n" + twice, "is of 32"},
           {"bzip2.nrrd", nrrd("short", "bzip2") + "\n" + kVoxels, "the encoding \"bzip2\", which is not read"},
           {"letters.nrrd", with(nrrd(), "(0,0,2)", "(0,0,12abc)") + "\n" + kVoxels, "\"12abc\" in its field"},
           {"hex.nrrd", with(nrrd(), "(1,2,3)", "(0x10,2,3)") + "\n" + kVoxels, "\"0x10\" in its field"},
           {"huge.nrrd", with(nrrd(), "(1,0,0)", "(1e308,0,0)") + "\n" + kVoxels, "\"1e308\" in its field"},
           {"sizes.nrrd", with(nrrd(), "4 3 2", "4 3abc 2") + "\n" + kVoxels, "\"3abc\" in its field \"sizes\""},
           {"plus.nrrd", with(nrrd(), "(0,0,2)", "(0,0,+2.0e0)") + "\n" + kVoxels, ""},
           {"block.nrrd", nrrd("block", "raw", "block size: 2\n") + "\n" + kVoxels, "the type \"block\""},
           {"endless.nrrd", nrrd("short", "raw", "") + "\n" + kVoxels, "no \"endian\""},
           {"both.nrrd", nrrd() + "spacings: 1 1 2\n\n" + kVoxels, "both \"spacings\" and \"space directions\""},
           {"beside.nrrd",
            "NRRD0004\ntype: short\ndimension: 3\nspace: LPS\nsizes: 4 3 2\nendian: little\nencoding: raw\n"
            "spacings: 1 1 2\n\n" +
                kVoxels,
            "\"spacings\" beside its \"space\""},
           {"four.nrrd",
            "NRRD0004\ntype: short\ndimension: 4\nsizes: 4 3 2 1\nendian: little\nencoding: raw\n\n" + kVoxels,
            "more than three dimensions"},
           {"quantised.nrrd", nrrd("short", "raw", "endian: little\nold min: -1000\nold max: 3000\n") + "\n" + kVoxels,
            "stand for other values (\"old min\" -1000)"},
           {"oldmax.nrrd", nrrd("uchar", "raw", "oldmax: 3000\n") + "\n" + kVoxels.substr(24), "\"old max\" 3000"},
           {"unquantised.nrrd", nrrd("short", "raw", "endian: little\nold min: nan\n") + "\n" + kVoxels, ""},
           {"lone.nhdr", nrrd() + "data file: gone.raw\n\n", "\"gone.raw\" is not there"},
           {"one_word.nhdr", nrrd() + "datafile: LIST\nthere.raw\ngone.raw\n", "\"gone.raw\" is not there"},
           {"units.nrrd", nrrd() + "spaceunits: \"cm\" \"cm\" \"cm\"\n\n" + kVoxels, "lengths in \"cm\""},
           {"list.nhdr", nrrd() + "data file: LIST\nthere.raw\ngone.raw\n", "\"gone.raw\" is not there"},
           {"dotted.nhdr", nrrd() + "data file: ./there.raw\n\n", ""},
           {"below.nhdr", nrrd() + "data file: below/there.raw\n\n", "in another folder (\"below/there.raw\")"},
           {"above.nhdr", nrrd() + "data file: LIST\n../there.raw\n", "in another folder (\"../there.raw\")"},
           {"many.nhdr", nrrd() + "data file: below/%d.raw 0 1 1\n\n", "in another folder (\"below/%d.raw 0 1 1\")"},
           {"detached.nrrd", nrrd() + "data file: there.raw\n\n", "name it .nhdr, or save it as one file"},
           {"cut.nrrd", nrrd() + "\nshort", "cut short or damaged"},
           {"good.mha", meta_image() + kVoxels, ""},
           {"more.mha", with(meta_image(), "4 3 2", "4 2 2") + kVoxels, "is of 32"},
           {"packed.mha", meta_image("MET_SHORT", sized) + packed, ""},
           {"more_packed.mha", with(meta_image("MET_SHORT", sized), "4 3 2", "3 3 2") + packed, "is of 36"},
           {"one_packed.mha",
            with(meta_image("MET_SHORT", sized), "CompressedData = True", "CompressedData = 1") + packed, ""},
           {"plain_values.mha",
            meta_image("MET_SHORT", "ElementToIntensityFunctionSlope = 1.0\nElementToIntensityFunctionOffset = 0\n") +
                kVoxels,
            ""},
           {"slope.mha", meta_image("MET_SHORT", "ElementToIntensityFunctionSlope = 2\n") + kVoxels,
            "stand for other values (ElementToIntensityFunctionSlope 2)"},
           {"offset.mha", meta_image("MET_SHORT", "ElementToIntensityFunctionOffset = -1024\n") + kVoxels,
            "stand for other values (ElementToIntensityFunctionOffset -1024)"},
           {"two_slopes.mha",
            meta_image("MET_SHORT", "ElementToIntensityFunctionSlope = 1\nElementToIntensityFunctionSlope = 2\n") +
                kVoxels,
            "\"ElementToIntensityFunctionSlope\" twice"},
           {"centimetres.mha", meta_image("MET_SHORT", "DistanceUnits = cm\n") + kVoxels,
            "lengths in cm (DistanceUnits)"},
           {"headless.mha", meta_image("MET_SHORT", "HeaderSize = 0\n") + kVoxels, ""},
           {"from_end.mha", meta_image("MET_SHORT", "HeaderSize = -1\n") + kVoxels, ""},
           {"in_header.mha", meta_image("MET_SHORT", "HeaderSize = 100\n") + kVoxels, "begin at byte 100 (HeaderSize)"},
           {"digits.mha", with(meta_image(), "BinaryData = True", "BinaryData = 0") + kDigits, ""},
           {"less_packed.mha", with(meta_image("MET_SHORT", sized), "4 3 2", "5 3 2") + packed, "cut short or damaged"},
           {"twice_packed.mha", meta_image("MET_SHORT", twice_sized) + twice, "cut short or damaged"},
           {"plain.mha", with(meta_image(), "BinaryData = True\n", "") + kVoxels, ""},
           {"more_plain.mha", with(with(meta_image(), "BinaryData = True\n", ""), "4 3 2", "4 2 2") + kVoxels,
            "is of 32"},
           {"beside.mhd", meta_image("MET_SHORT", "", "there.raw"), ""},
           {"more.mhd", with(meta_image("MET_SHORT", "", "there.raw"), "4 3 2", "3 3 2"), "is of 36"},
           {"text.mha", meta_image("MET_STRING") + kVoxels, "the type MET_STRING"},
           {"half.mha", meta_image("MET_HALF") + kVoxels, "the type MET_HALF"},
           {"lone.mhd", meta_image("MET_SHORT", "", "gone.raw"), "\"gone.raw\" is not there"},
           {"list.mhd", meta_image("MET_SHORT", "", "LIST") + "there.raw\ngone.raw\n", "\"gone.raw\" is not there"},
           {"below.mhd", meta_image("MET_SHORT", "", "below/there.raw"), "in another folder (\"below/there.raw\")"},
           {"detached.mha", meta_image("MET_SHORT", "", "there.raw"), "name it .mhd, or save it as one file"},
           {"unsized.mha", meta_image("MET_SHORT", compressed) + kVoxels, "(CompressedDataSize); save it"},
           {"missized.mha", meta_image("MET_SHORT", compressed + "CompressedDataSize = 9\n") + kVoxels,
            "take 9 bytes (CompressedDataSize), and 48 follow"},
           {"cut.mha", meta_image() + "short", "cut short or damaged"},
           {"good.nii", nifti(4, 16) + kVoxels, ""},
           {"more.nii", nifti(4, 16) + kVoxels + kVoxels,
            "holds 96 bytes of voxels or more, and the size in its header is of 48"},
           {"colours.nii", nifti(128, 24) + kVoxels + kVoxels, "colours (datatype 128)"},
           {"complex.nii", nifti(32, 64) + kVoxels + kVoxels + kVoxels + kVoxels, "complex numbers (datatype 32)"},
           {"bits.nii", nifti(1, 1) + kVoxels, "single bits (datatype 1)"},
           {"wide.nii", nifti(1536, 128) + kVoxels, "floats of 128 bits"},
           {"unknown.nii", nifti(77, 16) + kVoxels, "the datatype 77"},
           {"two.nii", nifti(4, 32) + kVoxels, "16 bits by its datatype (4), 32 by its bitpix"},
           {"unplaced.nii", nifti_with(kOffset, 0.0F), "begin at byte 0 (vox_offset), within its header"},
           {"in_header.nii", nifti_with(kOffset, 348.0F), "begin at byte 348 (vox_offset)"},
           {"placed.nii", nifti_with(kOffset, 353.0F) + "\n", ""},
           {"scaled.nii", shifted(0.5F, -1000), ""},
           {"unscaled.nii", shifted(0, 0), ""},
           {"shifted.nii", shifted(0, -1000), "a scl_slope of 0, by which NIfTI takes the values as they are stored"},
           {"inverted.nii", shifted(-1, 0), "a scl_slope of -1, below 0"},
           {"unitless.nii", nifti_with(kUnits, '\0'), ""},
           {"seconds.nii", nifti_with(kUnits, '\x0a'), ""},
           {"no_unit.nii", nifti_with(kUnits, '\5'), "in the unit 5 (xyzt_units), which NIfTI does not know"},
           {"no_unit_in_seconds.nii", nifti_with(kUnits, '\x0c'), "in the unit 4 (xyzt_units)"},
           {"second.nii", std::string("\x1c\x02\0\0n+2\0", 8) + std::string(600, '\0'), "another version than 1"},
           {"lone.hdr", nifti(4, 16, "ni1"), "the file of its voxels, lone.img"},
           {"pair.hdr", nifti(4, 16, "ni1").substr(0, 348), ""},
           {"inverted.hdr", nifti_with(kSlope, -1.0F, "ni1"), "a scl_slope of -1, below 0"},
           {"pair.nii", nifti(4, 16, "ni1"), "name it .hdr, beside its .img"},
           {"zipped.hdr.gz", gzip(nifti(4, 16, "ni1").substr(0, 348)), ""},
           {"voxels.img", kVoxels, "give the one that ends in .hdr"}}) {
    const auto read = import_volume(fs::path(scratch.file(c.name, c.text)));
    EXPECT_EQ(read.has_value(), c.why.empty()) << c.name << (read ? "" : ": " + read.error().what);
    if (read) continue;
    EXPECT_NE(read.error().what.find(c.name + ": "), std::string::npos) << read.error().what;
    EXPECT_NE(read.error().what.find(c.why), std::string::npos) << read.error().what;
  }
}

/// Says of a MetaImage's header, in which this line stands instead of that one, what is refused; empty: it is read.
std::string refusal_of(const Scratch& scratch, const std::string& line, const std::string& instead) {
  const fs::path path = scratch.file("one.mha", with(meta_image(), line, instead) + kVoxels);
  const auto read = import_volume(path);
  return read ? std::string() : read.error().what;
}

// Their reader, MetaIO, takes no other spelling of a name and ':' for '='; what it passes over it fills in.
TEST(UnreadForm, ANameOfAMetaImageIsSpeltAsItsReaderSpellsIt) {
  const Scratch scratch;
  for (const char* line : {"NDims = 3", "BinaryDataByteOrderMSB = False", "TransformMatrix = 1 0 0 0 1 0 0 0 1",
                           "Offset = 1 2 3", "ElementSpacing = 1 1 2", "DimSize = 4 3 2", "ElementType = MET_SHORT"}) {
    const std::string right(line), name = right.substr(0, right.find(' '));
    ASSERT_EQ(refusal_of(scratch, right, right), "");
    EXPECT_EQ(refusal_of(scratch, right, "\n" + right + "\t"), "") << "blanks and blank lines do not matter";
    const std::string value = right.substr(name.size() + 2);
    std::string small = right, colon = right;
    small[0] = static_cast<char>(small[0] - 'A' + 'a');
    colon[name.size() + 1] = ':';
    const std::string first = lower_case(name) + " =" + value, both = name + " :=" + value;
    for (const std::string& wrong : {small, first, colon, both}) {
      for (const std::string& instead : {wrong, right + "\n" + wrong, wrong + "\n" + right}) {
        const std::string told = refusal_of(scratch, right, instead);
        EXPECT_NE(told.find("has the line \"" + wrong + "\""), std::string::npos) << instead << ": " << told;
        EXPECT_NE(told.find("write it as \"" + name + " = "), std::string::npos) << instead << ": " << told;
      }
    }
  }
  for (const char* more : {"elementsize = 1 1 3\n", "DistanceUnits : cm\n", "distanceunits = cm\n",
                           "elementtointensityfunctionslope = 2\n", "elementdatafile = LOCAL\nDistanceUnits = cm\n"}) {
    const std::string told = refusal_of(scratch, "NDims", more + std::string("NDims"));
    EXPECT_NE(told.find("has the line \""), std::string::npos) << more << ": " << told;
  }
  // Names that are nobody's but the writer's are spelt as the writer likes.
  EXPECT_EQ(refusal_of(scratch, "NDims", "comment : none\nSeq_Frame0000 : a = b\nNDims"), "");
}

// MetaIO takes the value of the line behind it for that of a line without a sign, and knows nothing of that line.
TEST(UnreadForm, ALineOfAMetaImageThatHidesTheNextOneIsRefused) {
  const Scratch scratch;
  for (const char* line : {"Offset = 1 2 3", "ElementSpacing = 1 1 2"}) {
    const std::string told = refusal_of(scratch, line, std::string("hidden\n") + line);
    EXPECT_NE(told.find("has the line \"hidden\" in its header, which has no \"=\""), std::string::npos) << told;
  }
}

}  // namespace
}  // namespace birdseye::host
