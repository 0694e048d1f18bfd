// What the window does where a file is not as it was, or another's: docs/manual/lies.md.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/host/operation/lies.hpp"
#include "tests/host/operation/read_lies.hpp"

namespace birdseye::testing {
namespace {

/// What a window takes up that another has kept, where something was done to it meanwhile.
Outcome taken_up(const std::function<void(const std::filesystem::path&)>& meanwhile, const Lie& lie = {}) {
  const Scratch kept;
  {
    Rehearsal before(1);
    before.settings = [&](host::LiveSettings& live) { live.out = kept.path(); };
    EXPECT_TRUE(before.begin() && before.register_patient() && before.check());
  }
  if (meanwhile) meanwhile(kept / "operation.json");
  Rehearsal again(1);
  again.settings = [&](host::LiveSettings& live) { live.resume = kept.path(); };
  if (lie) lie(again);
  EXPECT_TRUE(again.begin());
  again.workflow().confirm_patient();
  Outcome out = outcome_of(again.watch(kWatched_s));
  std::string fault = again.workflow().view().fault;
  if (const auto at = fault.find(kept.path().string()); at != std::string::npos)
    fault.replace(at, kept.path().string().size(), "OUT");
  out.said.push_back(fault);
  return out;
}

void edit(const std::filesystem::path& file, const std::function<void(std::string&)>& change) {
  std::ifstream in(file);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  ASSERT_FALSE(text.empty()) << file;
  change(text);
  std::ofstream(file) << text;
}

std::vector<Row> of_files() {
  return {
      {"an operation of which one figure was edited", Must::refuse, "operation.json", "",
       [] {
         return taken_up([](const auto& file) {
           edit(file, [](std::string& text) {
             const auto at = text.find_last_of("123456789");
             text[at] = text[at] == '1' ? '2' : '1';
           });
         });
       }},
      {"an operation that was half written", Must::refuse, "operation.json", "",
       [] {
         return taken_up([](const auto& file) { edit(file, [](std::string& text) { text.resize(text.size() / 2); }); });
       }},
      {"an operation taken up with last week's CT of the patient", Must::refuse, "another CT", "",
       [] { return taken_up({}, [](Rehearsal& o) { o.markers_mm[0].x() += 2; }); }},
      {"an operation taken up, and the patient has moved since", Must::refuse, "two landmarks",
       "a landmark is asked for first", [] { return taken_up({}, move_patient); }},
      {"a calibration record of which one figure was edited", Must::refuse, "checksum does not fit", "",
       [] {
         return from_the_start([](Rehearsal& o) {
           o.change_record = [](std::string& text) {
             const auto at = text.find("\"fx_px\"");
             const auto digit = text.find_first_of("123456789", at);
             text[digit] = text[digit] == '9' ? '8' : '9';
           };
         });
       }},
      {"labels of another CT", Must::refuse, "labels.nrrd", "", [] { return Outcome{{of_labels_of_another_ct()}}; }},
      {"a recording whose camera was exchanged, replayed", Must::refuse, "camera serial", "",
       [] { return Outcome{{of_a_recording_of_another_camera()}}; }},
      {"the field map of another cart", Must::refuse, "the field's map is of tracker", "its poses are not published",
       [] { return Outcome{{of_another_carts_field_map()}}; }},
  };
}

TEST(Lies, OfFiles) {
  settle("files", of_files());
}

}  // namespace
}  // namespace birdseye::testing
