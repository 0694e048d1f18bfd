// Colours that people who see few of them tell apart, in a dark room and in a light one.
#include "host/window/theme.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "host/overlay/margins.hpp"
#include "host/render/scene/transfer_function.hpp"

namespace birdseye::host {
namespace {

double linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}
Eigen::Vector3d linear_of(const Eigen::Vector3f& rgb) {
  return {linear(rgb.x()), linear(rgb.y()), linear(rgb.z())};
}

/// The relative contrast of WCAG 2.
double contrast(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const Eigen::Vector3d luminance(0.2126, 0.7152, 0.0722);
  const double one = luminance.dot(linear_of(a)) + 0.05, other = luminance.dot(linear_of(b)) + 0.05;
  return std::max(one, other) / std::min(one, other);
}

/// CIE L*a*b* under D65 of linear RGB.
Eigen::Vector3d lab_of(const Eigen::Vector3d& rgb) {
  Eigen::Matrix3d xyz_from_rgb;
  xyz_from_rgb << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  Eigen::Vector3d xyz = xyz_from_rgb * rgb.cwiseMax(0).cwiseMin(1);
  xyz = xyz.cwiseQuotient(Eigen::Vector3d(0.9505, 1, 1.089));
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; };
  return {116 * f(xyz.y()) - 16, 500 * (f(xyz.x()) - f(xyz.y())), 200 * (f(xyz.y()) - f(xyz.z()))};
}

/// What an eye sees: all colours, or without its red, green or blue cones (Machado, Oliveira and Fernandes, A
/// physiologically-based model for simulation of color vision deficiency, 2009, severity 1).
std::vector<Eigen::Matrix3d> eyes() {
  Eigen::Matrix3d no_red, no_green, no_blue;
  no_red << 0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998;
  no_green << 0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881;
  no_blue << 1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900;
  return {Eigen::Matrix3d::Identity(), no_red, no_green, no_blue};
}

TEST(Theme, GoodWarnAndBadAreToldApartByEveryEye) {
  constexpr double kApart = 20;  // where 2.3 can just be seen
  for (const Room room : {Room::dark, Room::light}) {
    const Theme& theme = theme_of(room);
    for (const Eigen::Matrix3d& eye : eyes()) {
      const auto apart = [&eye](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
        return (lab_of(eye * linear_of(a)) - lab_of(eye * linear_of(b))).norm();
      };
      EXPECT_GT(apart(theme.good, theme.warn), kApart) << static_cast<int>(room);
      EXPECT_GT(apart(theme.good, theme.bad), kApart) << static_cast<int>(room);
      EXPECT_GT(apart(theme.warn, theme.bad), kApart) << static_cast<int>(room);
    }
  }
}

TEST(Theme, WhatTheOverlayShowsIsToldApartByEveryEye) {
  const auto transfer = load_transfer_function("tumour-and-vessels");
  ASSERT_TRUE(transfer);
  const auto colour_at = [&transfer](int hu) {
    const TransferFunction::Entry& entry = transfer->at(hu);
    return Eigen::Vector3f(entry.r, entry.g, entry.b);
  };
  // Hepatic veins, portal veins, tumour, and the liver's own red beneath them.
  const Eigen::Vector3f veins = colour_at(160), portal = colour_at(220), tumour = colour_at(350),
                        liver(0.6F, 0.25F, 0.2F);
  for (const Eigen::Matrix3d& eye : eyes()) {
    const auto apart = [&eye](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
      return (lab_of(eye * linear_of(a)) - lab_of(eye * linear_of(b))).norm();
    };
    for (const Eigen::Vector3f& vessel : {veins, portal}) {
      EXPECT_GT(apart(tumour, vessel), 20);
      EXPECT_GT(apart(vessel, liver), 20);
    }
    EXPECT_GT(apart(veins, portal), 20);
    EXPECT_GT(apart(tumour, liver), 20);
    // The shell next to the tumour, against the tumour, its outline, which is of the colours between, and the vessels.
    for (int hu = 160; hu <= 500; hu += 20) EXPECT_GT(apart(margin_colour(0).cast<float>(), colour_at(hu)), 20) << hu;
    for (std::size_t a = 0; a < kMostMargins; ++a) {
      EXPECT_GT(apart(margin_colour(a).cast<float>(), liver), 20) << a;
      for (const Eigen::Vector3f& vessel : {veins, portal})
        EXPECT_GT(apart(margin_colour(a).cast<float>(), vessel), 20) << a;
      for (std::size_t b = 0; b < a; ++b)
        EXPECT_GT(apart(margin_colour(a).cast<float>(), margin_colour(b).cast<float>()), 15) << a << " " << b;
    }
  }
}

TEST(Theme, TextStandsOutFromTheBackground) {
  for (const Room room : {Room::dark, Room::light}) {
    const Theme& theme = theme_of(room);
    EXPECT_GT(contrast(theme.text, theme.background), 7);
    for (const Eigen::Vector3f& colour : {theme.quiet, theme.good, theme.warn, theme.bad})
      EXPECT_GT(contrast(colour, theme.background), 4.5) << static_cast<int>(room) << " " << colour.transpose();
  }
  // What lies over the video has a black ground, whatever the room.
  EXPECT_GT(contrast(theme_over_video().bad, Eigen::Vector3f::Zero()), 4.5);
}

}  // namespace
}  // namespace birdseye::host
