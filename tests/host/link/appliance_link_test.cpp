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

TEST(ServerAddress, MayNameTheMachineThatIsToAnswer) {
  const auto named = ServerAddress::parse("cart-1@192.168.1.30:18945");
  ASSERT_TRUE(named) << named.error().what;
  EXPECT_EQ(named->machine, "cart-1");
  EXPECT_EQ(named->name(), "192.168.1.30:18945");
  EXPECT_EQ(ServerAddress::parse("ward@cart@host")->machine, "ward@cart") << "no host has an @ in its name";
  EXPECT_EQ(ServerAddress::parse("cart")->machine, "");
  const auto plain = ServerAddress::parse("plain:cart-1@cart");
  ASSERT_FALSE(plain);
  EXPECT_NE(plain.error().what.find("shows no key where it speaks plain"), std::string::npos) << plain.error().what;
}

TEST(ServerAddress, WhoAnswersIsSaidWhereAKeyWasShown) {
  EXPECT_EQ(answered_words("192.168.1.20:18944", "cart-1"), "192.168.1.20:18944 is cart-1, by its key");
  EXPECT_EQ(answered_words("192.168.1.20:18944", ""), "");
}

TEST(ServerAddress, WhatIsNoneIsRefused) {
  for (const char* wrong : {"", ":1", "cart:", "cart:0", "cart:65536", "cart:1x", "plain:", "plain::1", "@cart", "a@"})
    EXPECT_FALSE(ServerAddress::parse(wrong)) << wrong;
}

}  // namespace
}  // namespace birdseye::host
