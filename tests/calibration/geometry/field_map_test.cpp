#include "calibration/geometry/field_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace birdseye::calibration {
namespace {

FieldMapData constant_map(FieldBasis basis, int order) {
  FieldMapData data;
  data.functions.basis = basis;
  data.functions.order = order;
  data.functions.low_mm = {100, -200, -50};
  data.functions.high_mm = {500, 200, 250};
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> part(0, 1);
  for (int i = 0; basis == FieldBasis::rbf && i < order; ++i)
    data.functions.centres_mm.emplace_back(100 + 400 * part(rng), 400 * part(rng) - 200, 300 * part(rng) - 50);
  data.position_mm.assign(data.functions.count(), Eigen::Vector3d::Zero());
  data.sigma_mm.assign(9 * 9 * 9, 0.5);
  return data;
}

std::vector<FieldMapData> each_family() {
  std::vector<FieldMapData> out;
  for (int order = 1; order <= 4; ++order) out.push_back(constant_map(FieldBasis::polynomial, order));
  for (int order = 2; order <= 5; ++order) out.push_back(constant_map(FieldBasis::bernstein, order));
  out.push_back(constant_map(FieldBasis::rbf, 40));
  return out;
}

std::vector<double> values_at(const FieldFunctions& functions, const Eigen::Vector3d& place) {
  std::vector<double> values(FieldFunctions::kMost, NAN);
  functions.evaluate(place, values);
  values.resize(functions.count());
  return values;
}

TEST(FieldMap, FunctionsAreWhatTheirNamesSay) {
  const Eigen::Vector3d place(180, 60, 30);
  const Eigen::Vector3d u(-0.6, 0.3, -1 + 80.0 / 150);
  const auto bernstein = values_at(constant_map(FieldBasis::bernstein, 5).functions, place);
  double sum = 0;
  for (const double value : bernstein) {
    EXPECT_GE(value, 0);
    sum += value;
  }
  EXPECT_NEAR(sum, 1, 1e-12);  // they are a partition of one
  EXPECT_NEAR(bernstein[1], 5 * 0.2 * std::pow(0.8, 4) * std::pow(0.35, 5) * std::pow(1 - 80.0 / 300, 5), 1e-12);
  const auto polynomial = values_at(constant_map(FieldBasis::polynomial, 4).functions, place);
  ASSERT_EQ(polynomial.size(), 35U);
  for (int degree = 0; degree <= 4; ++degree)
    EXPECT_NEAR(polynomial[static_cast<std::size_t>(degree)], std::legendre(static_cast<unsigned>(degree), u.x()),
                1e-12);
  EXPECT_NEAR(polynomial[5], u.y(), 1e-12);
  EXPECT_NEAR(polynomial[6], u.x() * u.y(), 1e-12);
  EXPECT_NEAR(polynomial.back(), std::legendre(4U, u.z()), 1e-12);
  const auto far = constant_map(FieldBasis::rbf, 40);
  EXPECT_NEAR(values_at(far.functions, place)[7],
              (place - far.functions.centres_mm[7]).norm() / Eigen::Vector3d(200, 200, 150).norm(), 1e-12);
}

TEST(FieldMap, CorrectsPositionAndOrientation) {
  FieldMapData data = constant_map(FieldBasis::polynomial, 1);
  data.position_mm[0] = {1, 2, 3};
  data.position_mm[1] = {4, 0, 0};  // in x
  data.rotation_rad.assign(4, Eigen::Vector3d::Zero());
  data.rotation_rad[0] = {0, 0, 0.1};
  const auto map = FieldMap::from(data);
  ASSERT_TRUE(map) << map.error().what;
  const Eigen::Matrix3d turned = rotation_exp({0.3, 0.2, 0.1});
  const auto corrected = map->correct({turned, Eigen::Vector3d(500, 0, 0)});
  ASSERT_TRUE(corrected);
  EXPECT_LT((corrected->tracker_from_sensor.translation() - Eigen::Vector3d(505, 2, 3)).norm(), 1e-12);
  EXPECT_LT((corrected->tracker_from_sensor.rotation() - rotation_exp({0, 0, 0.1}) * turned).norm(), 1e-12);
  EXPECT_EQ(corrected->sigma_mm, 0.5);
  EXPECT_LT((*map->correction_mm({300, 0, 0}) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST(FieldMap, OutsideThereIsNoAnswer) {
  for (const FieldMapData& data : each_family()) {
    const auto map = FieldMap::from(data);
    ASSERT_TRUE(map) << map.error().what;
    EXPECT_TRUE(map->correct({Eigen::Matrix3d::Identity(), Eigen::Vector3d(100, -200, -50)}));
    EXPECT_TRUE(map->correct({Eigen::Matrix3d::Identity(), Eigen::Vector3d(500, 200, 250)}));
    for (const Eigen::Vector3d& place :
         {Eigen::Vector3d(99.999, 0, 0), Eigen::Vector3d(500.001, 0, 0), Eigen::Vector3d(300, 0, 251),
          Eigen::Vector3d(NAN, 0, 0), Eigen::Vector3d(300, INFINITY, 0), Eigen::Vector3d(-3.697314e28, 0, 0)}) {
      EXPECT_FALSE(map->correct({Eigen::Matrix3d::Identity(), place}));
      EXPECT_FALSE(map->correction_mm(place));
      EXPECT_FALSE(map->why_not(place).empty());
    }
    EXPECT_EQ(map->why_not({300, 0, 0}), "");
  }
}

TEST(FieldMap, ACellWithANodeThatWasNotMappedHasNoAnswer) {
  FieldMapData data = constant_map(FieldBasis::polynomial, 2);
  data.sigma_mm[(4 * 9 + 4) * 9 + 4] = -1;  // the middle
  const auto map = FieldMap::from(data);
  ASSERT_TRUE(map);
  EXPECT_FALSE(map->sigma_mm({300, 0, 100}));
  EXPECT_FALSE(map->sigma_mm({345, 30, 120}));
  EXPECT_TRUE(map->sigma_mm({355, 30, 120}));
  EXPECT_NE(map->why_not({345, 30, 120}).find("not mapped near 345, 30, 120 mm"), std::string::npos);
}

TEST(FieldMap, NothingIsCorrectedWhereTheMapIsNotSure) {
  FieldMapData data = constant_map(FieldBasis::polynomial, 2);
  data.sigma_mm.assign(9 * 9 * 9, 2.6);
  for (std::size_t z = 0; z < 9; ++z) data.sigma_mm[z * 81] = 2.4;  // along the edge x = 100, y = -200
  const auto map = FieldMap::from(data);
  ASSERT_TRUE(map) << map.error().what;
  const Eigen::Vector3d sure(100, -200, 60), unsure(300, 0, 100);
  EXPECT_TRUE(map->correct({Eigen::Matrix3d::Identity(), sure}));
  EXPECT_TRUE(map->correction_mm(sure));
  EXPECT_EQ(map->why_not(sure), "");
  EXPECT_FALSE(map->correct({Eigen::Matrix3d::Identity(), unsure}));
  EXPECT_FALSE(map->correction_mm(unsure));
  EXPECT_EQ(map->sigma_mm(unsure), 2.6);
  EXPECT_EQ(map->why_not(unsure), "at 300, 0, 100 mm the map of the field is sure to 2.6 mm, of at most 2.5");
}

TEST(FieldMap, SigmaIsInterpolated) {
  FieldMapData data = constant_map(FieldBasis::polynomial, 1);
  for (std::size_t i = 0; i < data.sigma_mm.size(); ++i) data.sigma_mm[i] = 1 + static_cast<double>(i % 9) / 8;
  const auto map = FieldMap::from(data);
  EXPECT_NEAR(*map->sigma_mm({130, -77, 12}), 1 + 30.0 / 400, 1e-12);
  EXPECT_NEAR(*map->sigma_mm({500, 200, 250}), 2, 1e-12);
}

TEST(FieldMap, DataThatMakesNoSenseIsRefused) {
  const auto refused = [](auto&& damage) {
    FieldMapData data = constant_map(FieldBasis::bernstein, 2);
    damage(data);
    return !FieldMap::from(std::move(data));
  };
  EXPECT_FALSE(refused([](FieldMapData&) {}));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.position_mm.pop_back(); }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.rotation_rad.resize(3); }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.sigma_mm.clear(); }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.functions.order = 9; }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.functions.high_mm = d.functions.low_mm; }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.position_mm[1].x() = NAN; }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.functions.low_mm.x() = -INFINITY; }));
  EXPECT_TRUE(refused([](FieldMapData& d) { d.functions.basis = FieldBasis::rbf; }));
}

}  // namespace
}  // namespace birdseye::calibration
