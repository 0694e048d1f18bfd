// `calibrate camera` and `calibrate hand-eye` with other forms of the same input: points found before, squeezed
// pictures, lenses of other programs, poses in tables.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "host/calibrate/picture_views.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/text_files.hpp"
#include "tests/support/command.hpp"
#include "tests/support/drawn_scope.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/lens_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::BoardPainter;
using testing::DrawnScope;
using testing::expect_refused;
using ::testing::HasSubstr;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_lens;

/// Twelve stations of a scope, drawn: pictures/1.png .., the same squeezed to half their rows in fields/, poses/1.txt
/// ..
class DrawnStations : public ::testing::Test {
 protected:
  static constexpr int kStations = 12;
  const Scratch scratch;
  DrawnScope scope{scratch.path()};
  const Transform<Camera, Sensor> camera_from_sensor{rotation_exp({0.2, -1.5, 0.1}), {6, -14, -300}};

  void SetUp() override {
    const BoardPainter painter(small_lens());
    fs::create_directories(scratch / "fields");
    int number = 0;
    for (const auto& view : scope.views(kStations)) {
      const std::string picture = fmt::format("{}.png", ++number);
      scope.paint("pictures/" + picture, painter, view);
      scope.write_pose(fmt::format("poses/{}.txt", number), view, camera_from_sensor);
      cv::Mat whole = cv::imread((scratch / ("pictures/" + picture)).string(), cv::IMREAD_GRAYSCALE), field;
      cv::resize(whole, field, {whole.cols, whole.rows / 2}, 0, 0, cv::INTER_AREA);
      cv::imwrite((scratch / ("fields/" + picture)).string(), field);
    }
    testing::write_lens(scratch / "lens.yml", small_lens());
  }
  [[nodiscard]] std::string at(const std::string& name) const { return (scratch / name).string(); }
  [[nodiscard]] std::string hand_eye(const std::string& more) const {
    return "calibrate hand-eye --json " + at("x.json") + " --board " + scope.board() + " " + more;
  }
  /// How far the camera's place on the sensor is off, mm.
  [[nodiscard]] double off_mm(const std::string& arguments) const {
    const auto done = run("birdseye", arguments);
    EXPECT_EQ(done.code, 0) << done.output;
    const auto rows = read_json(scratch / "x.json")["camera_from_sensor"];
    Eigen::Matrix4d m;
    for (std::size_t i = 0; i < 16; ++i) m(static_cast<int>(i / 4), static_cast<int>(i % 4)) = rows[i / 4][i % 4];
    const auto found = Transform<Camera, Sensor>::from_matrix(m);
    return (found.inverse().translation() - camera_from_sensor.inverse().translation()).norm();
  }
  /// The poses as rows of a table, without times.
  [[nodiscard]] std::string table_of_poses(int count) const {
    std::string text = "tx,ty,tz,q0,qx,qy,qz\r\n";
    for (int i = 1; i <= count; ++i) {
      const auto pose = Transform<Tracker, Sensor>::from_matrix(*host::read_pose(at(fmt::format("poses/{}.txt", i))));
      const Eigen::Quaterniond q = pose.quaternion();
      const Eigen::Vector3d& p = pose.translation();
      text += fmt::format("{},{},{},{},{},{},{}\r\n", p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
    }
    return text;
  }
};

TEST_F(DrawnStations, PosesOfATableWithoutTimesPairByTheirOrder) {
  const std::string images = "--camera " + at("lens.yml") + " --images " + at("pictures") + " --poses ";
  EXPECT_LT(off_mm(hand_eye(images + scratch.file("p.csv", table_of_poses(kStations)))), 0.5);
  EXPECT_THAT(read_json(scratch / "x.json")["notes"].dump(), HasSubstr("its poses count by their order"));
  expect_refused("birdseye", hand_eye(images + scratch.file("q.csv", table_of_poses(kStations - 1))),
                 {"12 pictures and 11 poses"});
}

TEST_F(DrawnStations, PosesPairWithThePicturesThatATableNames) {
  const auto rows = table_of_poses(kStations);
  std::vector<std::string> lines;
  for (std::size_t from = rows.find('\n') + 1; from < rows.size(); from = rows.find('\n', from) + 1)
    lines.push_back(rows.substr(from, rows.find('\r', from) - from));
  std::string named = "image,tx,ty,tz,q0,qx,qy,qz\nelsewhere.png," + lines[3] + "\n";
  for (std::size_t i = lines.size(); i-- > 1;)  // in another order, and without the first
    named += fmt::format("C:\\shots\\{}.png,{}\n", i + 1, lines[i]);
  const std::string images = "--camera " + at("lens.yml") + " --images " + at("pictures") + " --poses ";
  EXPECT_LT(off_mm(hand_eye(images + scratch.file("p.csv", named))), 0.5);
  const auto notes = read_json(scratch / "x.json")["notes"].dump();
  EXPECT_THAT(notes, HasSubstr("names the picture of each pose"));
  EXPECT_THAT(notes, HasSubstr("1.png: there is no pose that could be used"));
  EXPECT_EQ(read_json(scratch / "x.json")["stations_used"], kStations - 1);
  expect_refused("birdseye", hand_eye(images + scratch.file("q.csv", named + "5.png," + lines[0] + "\n")),
                 {"both name the picture 5.png"});
}

TEST_F(DrawnStations, PosesPairByTimeWithPicturesWhoseNamesAreTimes) {
  const auto rows = table_of_poses(kStations);
  fs::create_directories(scratch / "timed");
  std::string stream = "t,tx,ty,tz,q0,qx,qy,qz\n";
  int number = 0;
  for (std::size_t from = rows.find('\n') + 1; from < rows.size(); from = rows.find('\n', from) + 1) {
    const std::int64_t at_ns = 1'600'000'000'000'000'000 + 5'000'000'000 * ++number;
    fs::copy_file(scratch / fmt::format("pictures/{}.png", number), scratch / fmt::format("timed/{}.png", at_ns));
    // At the first station the tracker saw nothing.
    for (const int later_ms : {-12, 13, 2400})
      stream += fmt::format("{:.4f},{}\n", 1e-9 * static_cast<double>(at_ns) + 1e-3 * (number == 1 ? 2400 : later_ms),
                            rows.substr(from, rows.find('\r', from) - from));
  }
  EXPECT_LT(off_mm(hand_eye("--camera " + at("lens.yml") + " --images " + at("timed") + " --poses " +
                            scratch.file("p.csv", stream))),
            0.5);
  EXPECT_THAT(read_json(scratch / "x.json")["notes"].dump(), HasSubstr("poses pair with pictures by time"));
  EXPECT_EQ(read_json(scratch / "x.json")["stations_used"], kStations - 1);
}

TEST_F(DrawnStations, PointsFoundBeforeGiveWhatPicturesGive) {
  const auto views = host::read_picture_views(*calibration::parse_pattern(scope.board()), {scratch / "pictures"});
  ASSERT_TRUE(views && views->used.size() == kStations);
  fs::create_directories(scratch / "points");
  for (int v = 0; v < kStations; ++v) {
    const calibration::PatternView& view = views->used[static_cast<std::size_t>(v)];
    std::string ids, object, image;
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      ids += fmt::format("{}\n", view.ids[i]);
      object += fmt::format("{} {} 0\n", view.points_in_marker_mm[i].x(), view.points_in_marker_mm[i].y());
      image += v == 4 ? "nan nan\n" : fmt::format("{} {}\n", view.points_px[i].x(), view.points_px[i].y());
    }
    (void)scratch.file(fmt::format("points/ids.{}.txt", v), ids);
    (void)scratch.file(fmt::format("points/object_points.{}.txt", v), object);
    (void)scratch.file(fmt::format("points/image_points.{}.txt", v), image);
  }
  const std::string common = " --json " + at("x.json") + " --poses " + at("poses") + " --points " + at("points");
  EXPECT_LT(off_mm("calibrate hand-eye --camera " + at("lens.yml") + common), 0.5);
  EXPECT_EQ(read_json(scratch / "x.json")["stations_used"], kStations - 1);
  EXPECT_THAT(read_json(scratch / "x.json")["notes"].dump(),
              HasSubstr("image_points.4.txt: a point that is not finite"));
  EXPECT_LT(off_mm("calibrate hand-eye --size 640x400" + common), 2);
  expect_refused("birdseye", "calibrate hand-eye" + common, {"--size WIDTHxHEIGHT"});
  expect_refused("birdseye", "calibrate hand-eye --camera " + at("lens.yml") + " --size 320x200" + common,
                 {"640x400 for pictures of 320x200"});
  expect_refused("birdseye", "calibrate hand-eye --images " + at("pictures") + common, {"give one of --images"});
}

TEST_F(DrawnStations, SqueezedPicturesGiveALensWhoseFocalLengthsDifferByTheAspect) {
  const std::string lens = at("field.yml");
  const auto done = run("birdseye", "calibrate camera --board " + scope.board() + " --images " + at("fields") +
                                        " --pixel-aspect 1:2 --out " + lens + " --record " + at("scope.json") +
                                        " --json " + at("c.json"));
  ASSERT_EQ(done.code, 0) << done.output;
  const auto json = read_json(scratch / "c.json");
  const auto found = host::read_camera(lens);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(json["pixel_aspect"], 0.5);
  EXPECT_NEAR(found->fx_px, 427, 3 * json["sigma"]["fx_px"].get<double>());
  EXPECT_NEAR(found->fy_px, 213.5, 3 * json["sigma"]["fy_px"].get<double>());
  EXPECT_NEAR(found->cy_px, (203 + 0.5) / 2 - 0.5, 3 * json["sigma"]["cy_px"].get<double>());
  EXPECT_THAT(testing::contents_of(scratch / "scope.json"), HasSubstr("pixel aspect 0.5"));
  const std::string fields = "--pixel-aspect 0.5 --images " + at("fields") + " --poses " + at("poses");
  EXPECT_LT(off_mm(hand_eye(fields + " --camera " + lens)), 1);
  CameraModel square = *found;
  square.fy_px = square.fx_px;
  testing::write_lens(scratch / "square.yml", square);
  expect_refused("birdseye", hand_eye(fields + " --camera " + at("square.yml")),
                 {"square.yml: its fy is 1 of fx, where --pixel-aspect says 0.5"});
  expect_refused("birdseye", hand_eye("--images x --poses y --pixel-aspect none"), {"--pixel-aspect none"});
  // Without the aspect the same pictures are told to be wrong.
  const auto without = run("birdseye", "calibrate camera --board " + scope.board() + " --images " + at("fields"));
  EXPECT_EQ(without.code, 3) << without.output;
}

TEST_F(DrawnStations, LensesOfOtherProgramsAreTakenAndWritten) {
  CameraModel lens = small_lens();
  const std::string chain = at("chain.yaml"), ros = at("ros.yaml");
  const auto exported = [&](const std::string& arguments) { return run("birdseye", "export lens " + arguments).code; };
  EXPECT_EQ(exported("--camera " + at("lens.yml") + " --as kalibr --out " + chain), 0);
  EXPECT_EQ(exported("--camera " + chain + " --as ros --name left --out " + ros), 0);
  EXPECT_EQ(exported("--camera " + ros + ":cam0 --as ros --out " + ros), 2);
  for (const std::string& path : {chain, chain + ":cam0", ros}) {
    EXPECT_EQ(*host::read_camera(path), lens) << path;
    EXPECT_LT(off_mm(hand_eye("--camera " + path + " --images " + at("pictures") + " --poses " + at("poses"))), 0.5);
  }
  lens.k3 = 0.1;
  testing::write_lens(scratch / "k3.yml", lens);
  expect_refused("birdseye", "export lens --camera " + at("k3.yml") + " --as kalibr --out " + at("no.yaml"),
                 {"k3 = 0.1"}, scratch / "no.yaml");
  expect_refused("birdseye", "export lens --as ros --out " + at("no.yaml"), {"one of --camera and --record"});
  expect_refused("birdseye",
                 "export lens --camera " + ros + " --as ros --right-camera " + ros + " --out " + at("no.yaml"),
                 {"--right-camera and --right-from-left together"});
}

}  // namespace
}  // namespace birdseye
