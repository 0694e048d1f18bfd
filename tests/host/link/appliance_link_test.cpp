#include "host/link/appliance_link.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

TEST(ServerAddress, HasAHostAPortAndWhetherItIsPlain) {
  const auto usual = ServerAddress::parse("cart");
  ASSERT_TRUE(usual) << usual.error().what;
  EXPECT_EQ(usual->name(), "cart:18944");
  EXPECT_FALSE(usual->plain);
  const auto plain = ServerAddress::parse("plain:192.168.1.30:18945");
  ASSERT_TRUE(plain) << plain.error().what;
  EXPECT_EQ(plain->name(), "192.168.1.30:18945");
  EXPECT_TRUE(plain->plain);
  EXPECT_EQ(ServerAddress::parse("plain:cart")->name(), "cart:18944");
}

TEST(ServerAddress, WhatIsNoneIsRefused) {
  for (const char* wrong : {"", ":1", "cart:", "cart:0", "cart:65536", "cart:1x", "plain:", "plain::1"})
    EXPECT_FALSE(ServerAddress::parse(wrong)) << wrong;
}

}  // namespace
}  // namespace birdseye::host
