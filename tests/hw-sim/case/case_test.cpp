#include "hw-sim/case/registration_case.hpp"

#include <gtest/gtest.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>
#include <itkVector.h>
#include <itkVectorLinearInterpolateImageFunction.h>

#include <Eigen/LU>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "calibration/geometry/camera_model.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/case/bezier_map.hpp"
#include "hw-sim/case/landmarks.hpp"
#include "hw-sim/case/subject.hpp"
#include "hw-sim/case/viewpoints.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using testing::contents_of;
using testing::read_json;
using testing::Scratch;

CaseSettings small_case(const fs::path& folder) {
  CaseSettings settings;
  settings.folder = folder;
  settings.seed = 3;
  settings.views = 3;
  settings.width_px = 384;
  settings.height_px = 288;
  settings.deformation.kind = DeformationKind::bezier;
  settings.deformation.inner = {3, 3, 3};
  return settings;
}

std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = contents_of(entry.path());
  }
  return files;
}

std::vector<TrueLandmark> read_landmarks(const fs::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  std::vector<TrueLandmark> landmarks;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    TrueLandmark l;
    words >> l.name >> l.rest_mm.x() >> l.rest_mm.y() >> l.rest_mm.z() >> l.deformed_mm.x() >> l.deformed_mm.y() >>
        l.deformed_mm.z();
    EXPECT_TRUE(words) << line;
    landmarks.push_back(l);
  }
  return landmarks;
}

Transform<Camera, Patient> read_view(const fs::path& path) {
  std::ifstream in(path);
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) in >> m(i / 4, i % 4);
  return Transform<Camera, Patient>::from_matrix(m);
}

TEST(Case, TheSameSettingsGiveTheSameBytesAndAnotherSeedDoesNot) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "a");
  ASSERT_TRUE(write_case(settings));
  settings.folder = scratch / "b";
  ASSERT_TRUE(write_case(settings));
  settings.folder = scratch / "c";
  settings.seed = 4;
  ASSERT_TRUE(write_case(settings));
  const auto a = files_of(scratch / "a");
  EXPECT_EQ(a.size(), 16U);  // case, camera, mask, CT, labels, four of the truth, two a view, and the list of them
  EXPECT_TRUE(a == files_of(scratch / "b"));
  auto c = files_of(scratch / "c");
  for (const char* name : {"ct.nii.gz", "view0.png", "truth/field.mha", "truth/landmarks.csv"})
    EXPECT_NE(a.at(name), c.at(name)) << name;
}

/// As any program on ITK reads the field: rest = deformed + u(deformed), u trilinear between points h <= 4.7 mm apart.
/// With |u''| of at most some 10 mm / (25 mm)^2 that is exact to h^2 / 8 |u''| = 0.04 mm; at the bottom of a dent,
/// |u''| is 10 mm / (17 mm)^2 along two axes.
TEST(Case, TheFieldTakesTheDeformedLandmarksToRest) {
  const Scratch scratch;
  for (const auto& [phantom, kind] : {std::pair{"liver", DeformationKind::bezier},
                                      {"head", DeformationKind::bezier},
                                      {"liver", DeformationKind::push}}) {
    CaseSettings settings = small_case(scratch / phantom);
    settings.phantom = phantom;
    settings.deformation.kind = kind;
    ASSERT_TRUE(write_case(settings));
    using Field = itk::Image<itk::Vector<float, 3>, 3>;
    const auto reader = itk::ImageFileReader<Field>::New();
    reader->SetImageIO(itk::MetaImageIO::New());
    reader->SetFileName((scratch / phantom / "truth" / "field.mha").string());
    reader->Update();
    const auto field = itk::VectorLinearInterpolateImageFunction<Field, double>::New();
    field->SetInputImage(reader->GetOutput());
    int surface = 0, vessels = 0, tumours = 0, hidden = 0;
    double furthest_mm = 0;
    for (const TrueLandmark& l : read_landmarks(scratch / phantom / "truth" / "landmarks.csv")) {
      Field::PointType at;
      for (unsigned axis = 0; axis < 3; ++axis) at[axis] = l.deformed_mm[axis];
      const auto u = field->Evaluate(at);
      const Vector3d rest = l.deformed_mm + Vector3d(u[0], u[1], u[2]);
      EXPECT_LT((rest - l.rest_mm).norm(), kind == DeformationKind::push ? 0.2 : 0.05) << l.name;
      furthest_mm = std::max(furthest_mm, (l.deformed_mm - l.rest_mm).norm());
      surface += l.name.starts_with("surface_") ? 1 : 0;
      vessels += l.name.starts_with("vessel_") ? 1 : 0;
      tumours += l.name == "tumour" ? 1 : 0;
      hidden += l.name.starts_with("hidden_") ? 1 : 0;
    }
    EXPECT_GE(surface, 30);
    EXPECT_GE(vessels, 10);
    EXPECT_EQ(tumours, 1);
    EXPECT_EQ(hidden, surface);
    EXPECT_GT(furthest_mm, 3);
    EXPECT_GT(read_json(scratch / phantom / "truth" / "truth.json").at("min_jacobian"), 0.3);
  }
}

TEST(Case, OfAKindThatIsNoPatchNamesNoControlPoints) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "bend");
  settings.deformation.kind = DeformationKind::bend;
  ASSERT_TRUE(write_case(settings));
  EXPECT_FALSE(fs::exists(scratch / "bend/truth/control_points.json"));
  EXPECT_TRUE(fs::exists(scratch / "bend/truth/field.mha"));
  const std::string toml = contents_of(scratch / "bend/case.toml");
  EXPECT_EQ(toml.find("control_points.json"), std::string::npos);
  EXPECT_NE(toml.find("control_points = \"auto\""), std::string::npos);
  const auto truth = read_json(scratch / "bend/truth/truth.json");
  EXPECT_EQ(truth["deformation"]["kind"], "bend");
  EXPECT_EQ(truth["deformation"]["axis"].size(), 3U);
  EXPECT_FALSE(truth.contains("dof"));
}

/// Before black and without noise, the picture is lit just where the organ is: at the deformed landmarks of the
/// surface that a view sees. With a large deformation, some of them would lie beside it if they were at rest.
TEST(Case, DeformedSurfaceLandmarksLieOnTheOrganInThePicture) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "case");
  settings.plain_background = true;
  settings.noise = 0;
  settings.deformation.amplitude_mm = 30;
  ASSERT_TRUE(write_case(settings));
  const CameraModel lens = laparoscope_lens(settings.width_px, settings.height_px);
  const auto landmarks = read_landmarks(scratch / "case" / "truth" / "landmarks.csv");
  const cv::Mat mask = cv::imread((scratch / "case" / "mask.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(mask.size(), cv::Size(settings.width_px, settings.height_px));
  int beside = 0;
  std::vector<bool> lit(landmarks.size(), false);
  for (int view = 0; view < settings.views; ++view) {
    const auto pose = read_view(scratch / "case" / ("view" + std::to_string(view) + ".txt"));
    const cv::Mat picture =
        cv::imread((scratch / "case" / ("view" + std::to_string(view) + ".png")).string(), cv::IMREAD_GRAYSCALE);
    // The brightest value within a pixel of the point: at the organ's edge, the pixel itself may be beside it.
    const auto value_at = [&](const Vector3d& point) {
      const auto at = project(lens, pose * point);
      const cv::Point pixel(static_cast<int>(std::lround(at->x())), static_cast<int>(std::lround(at->y())));
      if (!cv::Rect({}, picture.size()).contains(pixel) || mask.at<std::uint8_t>(pixel) != 255) return -1;
      const cv::Mat near = picture(cv::Rect(pixel.x - 1, pixel.y - 1, 3, 3) & cv::Rect({}, picture.size()));
      return static_cast<int>(*std::max_element(near.begin<std::uint8_t>(), near.end<std::uint8_t>()));
    };
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      if (!landmarks[i].name.starts_with("surface_")) continue;
      // A point of the organ is lit, or the organ itself hides it: never is there nothing.
      EXPECT_NE(value_at(landmarks[i].deformed_mm), 0) << landmarks[i].name << " in view " << view;
      lit[i] = lit[i] || value_at(landmarks[i].deformed_mm) > 20;
      beside += value_at(landmarks[i].rest_mm) == 0 ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    EXPECT_TRUE(lit[i] || !landmarks[i].name.starts_with("surface_")) << landmarks[i].name;
  }
  EXPECT_GT(beside, 0);
}

/// Between the lens and a hidden point is other surface, or its own slants away, or it lies beside the picture: judged
/// by the mesh's vertices, not by the ray tracer that chose it.
TEST(Landmarks, HiddenLieWhereNoViewSeesThem) {
  const Subject subject = head_subject(2);
  const BezierMap still(subject.grid.origin_mm, subject.grid.last_mm(), {1, 1, 1});
  const CameraModel lens = laparoscope_lens(384, 288);
  const auto scope = Laparoscope::create({.lens = lens});
  ASSERT_TRUE(scope);
  (*scope)->set_cavity({.organ = subject.surface});
  const auto views = choose_viewpoints(subject, 3, subject.view_distance_mm, 2);
  const auto landmarks = choose_landmarks(subject, subject.surface, still, **scope, views, 2);
  ASSERT_TRUE(landmarks);
  int behind = 0;
  for (const TrueLandmark& l : *landmarks) {
    if (!l.name.starts_with("hidden_")) continue;
    // A face's back of the head lies behind it, seen from in front of the face.
    behind += subject.towards_scope.dot(l.deformed_mm - 0.5 * (still.low_mm() + still.high_mm())) < 0 ? 1 : 0;
    for (const auto& view : views) {
      double nearest_mm = 1e9;
      const Vector3d eye = view.inverse().translation();
      const Vector3d way = (l.deformed_mm - eye).normalized();
      for (const Eigen::Vector3f& v : subject.surface.vertices) {
        const Vector3d from = v.cast<double>() - eye;
        if (from.cross(way).norm() < 1.5) nearest_mm = std::min(nearest_mm, from.dot(way));
      }
      const auto at = project(lens, view * l.deformed_mm);
      const bool covered = nearest_mm < (l.deformed_mm - eye).norm() - 3;
      const bool slanted = std::any_of(subject.surface.vertices.begin(), subject.surface.vertices.end(), [&](auto& v) {
        const auto i = static_cast<std::size_t>(&v - subject.surface.vertices.data());
        return (v.template cast<double>() - l.deformed_mm).norm() < 1e-3 &&
               -way.dot(subject.surface.normals[i].template cast<double>()) < 0.26;
      });
      const bool beside = !at || (*at - Eigen::Vector2d(192, 144)).norm() > 120;
      EXPECT_TRUE(covered || slanted || beside) << l.name;
    }
  }
  EXPECT_GT(behind, 20);
}

TEST(Landmarks, TouchesLieOnTheUnseenSideAsFarOffAsTheirNoise) {
  const Subject subject = head_subject(2);
  const BezierMap still(subject.grid.origin_mm, subject.grid.last_mm(), {1, 1, 1});
  const auto scope = Laparoscope::create({.lens = laparoscope_lens(384, 288)});
  ASSERT_TRUE(scope);
  (*scope)->set_cavity({.organ = subject.surface});
  const auto views = choose_viewpoints(subject, 3, subject.view_distance_mm, 2);
  const auto touched = [&](int count, double noise_mm) {
    return choose_touches(subject, subject.surface, still, **scope, views, count, noise_mm, 2);
  };
  const auto exact = touched(40, 0), noisy = touched(40, 2);
  ASSERT_TRUE(exact && noisy);
  ASSERT_EQ(exact->size(), 40U);
  double sum_mm2 = 0;
  for (std::size_t n = 0; n < exact->size(); ++n) {
    const Mesh& organ = subject.surface;
    const auto vertex = std::find_if(organ.vertices.begin(), organ.vertices.end(), [&](const Eigen::Vector3f& v) {
      return (v.cast<double>() - (*exact)[n]).norm() < 1e-3;
    });
    ASSERT_NE(vertex, organ.vertices.end());
    const Vector3d normal = organ.normals[static_cast<std::size_t>(vertex - organ.vertices.begin())].cast<double>();
    for (const auto& view : views) EXPECT_FALSE((*scope)->sees(view, (*exact)[n], normal));
    sum_mm2 += ((*noisy)[n] - (*exact)[n]).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(sum_mm2 / 120), 2, 0.4);
  EXPECT_FALSE(touched(100000, 1));
}

TEST(Case, NamesTouchesWhereThereAreAny) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "c");
  settings.touches = 12;
  settings.touch_noise_mm = 0.5;
  ASSERT_TRUE(write_case(settings));
  const std::string points = contents_of(scratch / "c/points.csv");
  EXPECT_EQ(points.rfind("x_mm,y_mm,z_mm,sigma_mm\n", 0), 0U);
  EXPECT_EQ(std::count(points.begin(), points.end(), '\n'), 13);
  EXPECT_NE(contents_of(scratch / "c/case.toml").find("[points]\npath = \"points.csv\""), std::string::npos);
  settings.touches = 0;
  ASSERT_TRUE(write_case(settings));
  EXPECT_FALSE(fs::exists(scratch / "c/points.csv"));
  EXPECT_EQ(contents_of(scratch / "c/case.toml").find("points.csv"), std::string::npos);
}

TEST(Case, ALampBesideTheLensAndAStillOrganChangeThePictureAlone) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "a");
  ASSERT_TRUE(write_case(settings));
  settings.folder = scratch / "lamp";
  settings.lamp_offset_mm = 20;
  ASSERT_TRUE(write_case(settings));
  settings.folder = scratch / "still";
  settings.lamp_offset_mm = 0;
  settings.deformation.amplitude_mm = 0;
  ASSERT_TRUE(write_case(settings));
  for (const char* other : {"lamp", "still"}) {
    for (const char* same : {"ct.nii.gz", "segmentation.nii.gz", "camera.yaml", "view0.txt", "view1.txt", "case.toml"})
      EXPECT_EQ(contents_of(scratch / "a" / same), contents_of(scratch / other / same)) << other << " " << same;
    EXPECT_NE(contents_of(scratch / "a" / "view0.png"), contents_of(scratch / other / "view0.png")) << other;
  }
  for (const TrueLandmark& l : read_landmarks(scratch / "still" / "truth" / "landmarks.csv"))
    EXPECT_EQ(l.rest_mm, l.deformed_mm);
}

TEST(Case, PosesThatErrLeaveThePicturesAndTellTheTruthBesideThem) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "true");
  ASSERT_TRUE(write_case(settings));
  settings.folder = scratch / "erring";
  settings.pose_error = {.noise_mm = 1, .noise_deg = 0.3, .offset_mm = 2};
  ASSERT_TRUE(write_case(settings));
  for (const char* view : {"view0", "view1", "view2"}) {
    const std::string pose = std::string(view) + ".txt";
    EXPECT_EQ(contents_of(scratch / "true" / (std::string(view) + ".png")),
              contents_of(scratch / "erring" / (std::string(view) + ".png")));
    EXPECT_EQ(contents_of(scratch / "true" / pose), contents_of(scratch / "erring/truth" / pose));
    EXPECT_NE(contents_of(scratch / "true" / pose), contents_of(scratch / "erring" / pose));
    EXPECT_FALSE(fs::exists(scratch / "true/truth" / pose));
  }
  EXPECT_EQ(contents_of(scratch / "true/truth/landmarks.csv"), contents_of(scratch / "erring/truth/landmarks.csv"));
  EXPECT_EQ(read_json(scratch / "erring/truth/truth.json")["pose_offset_mm"], 2);
}

/// Before black and without noise, what changes in a picture is what they cover.
TEST(Case, InstrumentsCoverPartOfThePictures) {
  const Scratch scratch;
  CaseSettings settings = small_case(scratch / "free");
  settings.plain_background = true;
  settings.noise = 0;
  ASSERT_TRUE(write_case(settings));
  settings.folder = scratch / "covered";
  settings.instruments = 3;
  ASSERT_TRUE(write_case(settings));
  double most = 0;
  for (const char* view : {"view0.png", "view1.png", "view2.png"}) {
    const cv::Mat free = cv::imread((scratch / "free" / view).string());
    const cv::Mat covered = cv::imread((scratch / "covered" / view).string());
    int changed = 0;
    for (int y = 0; y < free.rows; ++y) {
      for (int x = 0; x < free.cols; ++x) changed += free.at<cv::Vec3b>(y, x) != covered.at<cv::Vec3b>(y, x) ? 1 : 0;
    }
    const double share = changed / static_cast<double>(free.total());
    EXPECT_LT(share, 0.3) << view;
    most = std::max(most, share);
  }
  EXPECT_GT(most, 0.01);
}

TEST(Case, AFileByOneOfItsNamesIsRefusedUnlessAnEarlierCaseListsIt) {
  const Scratch scratch;
  fs::create_directories(scratch / "c/truth");
  for (const char* name : {"ct.nii.gz", "view17.txt", "points.csv", "truth/control_points.json"}) {
    const std::string own = scratch.file("c/" + std::string(name), "a user's");
    const auto outcome = write_case(small_case(scratch / "c"));
    ASSERT_FALSE(outcome) << name;
    EXPECT_EQ(outcome.error().what.rfind(own + ": is there, and no earlier birdseye-sim case", 0), 0U)
        << outcome.error().what;
    EXPECT_EQ(contents_of(own), "a user's");
    fs::remove(own);
  }
}

TEST(Case, RefusesInOneLine) {
  const Scratch scratch;
  const auto refused = [&](auto change, const std::string& word) {
    CaseSettings settings = small_case(scratch / "none");
    change(settings);
    const auto outcome = write_case(settings);
    ASSERT_FALSE(outcome) << word;
    EXPECT_NE(outcome.error().what.find(word), std::string::npos) << outcome.error().what;
    EXPECT_EQ(outcome.error().what.find('\n'), std::string::npos);
    EXPECT_FALSE(fs::exists(scratch / "none"));
  };
  refused([](CaseSettings& s) { s.deformation.amplitude_mm = 80; }, "fold");
  refused([](CaseSettings& s) { s.deformation.amplitude_mm = -1; }, "--amplitude-mm");
  refused(
      [](CaseSettings& s) {
        s.deformation.kind = DeformationKind::bend;
        s.deformation.amplitude_mm = 70;
      },
      "--amplitude-mm 70");
  refused([](CaseSettings& s) { s.texture = -1; }, "--texture");
  refused([](CaseSettings& s) { s.wet = 6; }, "--wet");
  refused([](CaseSettings& s) { s.blood = 1.1; }, "--blood");
  refused([](CaseSettings& s) { s.instruments = 4; }, "--instruments");
  refused([](CaseSettings& s) { s.blur_px = -0.5; }, "--blur-px");
  refused([](CaseSettings& s) { s.pose_error.offset_deg = -1; }, "--pose-offset-deg");
  refused([](CaseSettings& s) { s.touches = 301; }, "--touches");
  refused([](CaseSettings& s) { s.touch_noise_mm = 0; }, "--touch-noise-mm");
  refused([](CaseSettings& s) { s.deformation.push_width_mm = 5; }, "--push-width-mm");
  refused([](CaseSettings& s) { s.ct = "/nonexistent/ct.nii.gz"; }, "/nonexistent/ct.nii.gz: no such file");
  refused([](CaseSettings& s) { s.phantom = "foot"; }, "foot");
  refused([](CaseSettings& s) { s.views = 0; }, "--views");
  for (const char* text : {"5", "3x3", "0x1x1", "8x8x8", "", "3 "}) EXPECT_FALSE(parse_dof(text)) << text;
  EXPECT_EQ(*parse_dof("81"), (std::array<int, 3>{3, 3, 3}));
  EXPECT_EQ(*parse_dof("1x2x3"), (std::array<int, 3>{1, 2, 3}));
}

TEST(BezierMap, IsInvertedToAMillionthOfAMillimetreAndLeavesItsBoxStill) {
  const Vector3d low(-100, -80, 20), high(90, 100, 200);
  std::vector<Eigen::Vector3f> organ;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const auto share = [&](std::uint64_t key) { return static_cast<float>(0.15 + 0.7 * hashed_uniform(9, key)); };
    organ.emplace_back(
        Eigen::Vector3f(share(3 * i), share(3 * i + 1), share(3 * i + 2)).cwiseProduct((high - low).cast<float>()) +
        low.cast<float>());
  }
  for (const auto& [inner, amplitude_mm] :
       {std::pair{std::array{1, 1, 1}, 30.0}, {std::array{3, 3, 3}, 15.0}, {std::array{2, 1, 4}, 12.0}}) {
    const auto map = BezierMap::random(BezierMap(low, high, inner), amplitude_mm, organ, 5);
    ASSERT_TRUE(map) << map.error().what;
    EXPECT_GT(map->least_determinant(), TissueMap::kLeastDeterminant);
    double most_mm = 0;
    for (const Eigen::Vector3f& p : organ) {
      const Vector3d rest = p.cast<double>();
      const Vector3d deformed = map->deformed_of(rest);
      EXPECT_LT((map->rest_of(deformed) - rest).norm(), 1e-6);
      most_mm = std::max(most_mm, (deformed - rest).norm());
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d step = 1e-3 * Vector3d::Unit(axis);
        const Vector3d slope = (map->rest_of(deformed + step) - map->rest_of(deformed - step)) / 2e-3;
        EXPECT_LT((slope - map->jacobian(deformed).col(axis)).norm(), 1e-6);
      }
    }
    EXPECT_NEAR(most_mm, amplitude_mm, 1e-3 * amplitude_mm);
    EXPECT_LT(map->displacement_mm({low.x(), 0, 100}).norm(), 1e-9);
    EXPECT_LT(map->displacement_mm({0, 0, high.z()}).norm(), 1e-9);
    EXPECT_EQ(map->rest_of({300, 0, 100}), Vector3d(300, 0, 100));
  }
}

}  // namespace
}  // namespace birdseye::hw_sim
