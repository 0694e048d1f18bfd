#include "host/files/sealed_text.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace birdseye::host {
namespace {

TEST(SealedText, OneThatNestsWithoutEndIsRefusedThoughItsSealIsWhole) {
  nlohmann::json deep = 1;
  for (int i = 0; i < 100; ++i) deep = nlohmann::json::array({std::move(deep)});
  const auto read = unseal(sealed_text({{"version", deep}}));
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().what.find("nests lists deeper than any"), std::string::npos) << read.error().what;
  EXPECT_TRUE(unseal(sealed_text({{"version", nlohmann::json::array({1, 2})}})));
}

}  // namespace
}  // namespace birdseye::host
