#include "live_page.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace sila {
namespace {

TEST(LivePage, GetsTheSceneOfAModelOnceItHasLearnt) {
  Model model;
  EXPECT_FALSE(nlohmann::json::parse(model_message(model)).contains("scene"));
  model.sites.push_back({make_curb_frame({100, 50}, {1, 0}, {0, 1}, 2.5), 1, 20});
  const auto scene = nlohmann::json::parse(model_message(model)).at("scene");
  EXPECT_TRUE(scene.at("known").get<bool>());
  EXPECT_EQ(scene.at("corners").at(0).at("origin"), nlohmann::json({100.0, 50.0}));
}

}  // namespace
}  // namespace sila
