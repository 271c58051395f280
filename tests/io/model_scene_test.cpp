#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "core/track_frame.hpp"
#include "io/files.hpp"
#include "sila/io/scene.hpp"
#include "sila/model/packing.hpp"
#include "support/message_of.hpp"

namespace sila {
namespace {

std::vector<FramedTrajectory> walk(double x_m) {
  return {{{"1", {0.0, 1.0, 2.0}, {{x_m, 0}, {x_m + 1, 0.1}, {x_m + 2, 0}}}, {}}};
}

Model model_at(const CurbFrame& frame) {
  Model model;
  find_or_add_site(model.sites, frame);
  return model;
}

std::string rejection(const Scene& given, const Model& model) {
  return message_of([&] { scene_for(given, model, {}, CornerChoice::primary); });
}

TEST(ModelScene, OfANewModelIsMadeFromTheFirstBatchAndThenKept) {
  const Scene first = scene_for({}, {}, walk(5), CornerChoice::primary);
  ASSERT_EQ(first.corners.size(), 1U);
  EXPECT_TRUE(first.corners[0].frame.from_tracks);
  const Model model = model_at(first.corners[0].frame);
  const Scene later = scene_for({}, model, walk(500), CornerChoice::primary);
  EXPECT_EQ(pack(later.corners.at(0).frame), pack(first.corners[0].frame));
}

TEST(ModelScene, AGivenSceneMustBeTheFrameThatTheModelBeganWith) {
  const CurbFrame frame = frame_of_tracks(walk(5));
  const Model model = model_at(frame);
  Scene same = scene_of(model), other = same;
  same.corners[0].frame.from_tracks = false;  // as it comes from the file that `sila scene show` writes
  EXPECT_EQ(rejection(same, model), "");
  other.name = "yard";
  other.corners[0].frame.origin_m.x() += 20.0;
  EXPECT_TRUE(says(rejection(other, model), "yard"));
  EXPECT_TRUE(says(rejection(other, model), "leave the scene out"));
  EXPECT_EQ(rejection(other, model_at(same.corners[0].frame)), "");  // a model of scene files may have several
}

TEST(ModelScene, OfAFusedModelMayBeThatOfAnyOfItsSites) {
  Model model = model_at(frame_of_tracks(walk(5)));
  CurbFrame second = frame_of_tracks(walk(500));
  second.from_tracks = false;
  find_or_add_site(model.sites, second);
  EXPECT_EQ(rejection(scene_of(model_at(second)), model), "");
  second.origin_m.x() += 20.0;
  EXPECT_TRUE(says(rejection(scene_of(model_at(second)), model), "leave the scene out"));
}

TEST(ModelScene, HasTheYAxisOfItsFrames) {
  CurbFrame frame;
  EXPECT_EQ(scene_of(model_at(frame)).y_axis, YAxis::up);
  std::swap(frame.axis_1, frame.axis_2);
  EXPECT_EQ(scene_of(model_at(frame)).y_axis, YAxis::down);
  EXPECT_TRUE(mirrored_axes(scene_of(model_at(frame))).empty());
}

TEST(ModelScene, OfSeveralSitesMustBeGivenUnlessTracksGoToTheNearest) {
  Model model = model_at(frame_of_tracks(walk(5)));
  find_or_add_site(model.sites, frame_of_tracks(walk(500)));
  EXPECT_TRUE(says(rejection({}, model), "2 sites"));
  EXPECT_EQ(scene_for({}, model, {}, CornerChoice::nearest).corners.size(), 2U);
}

TEST(ModelScene, WarnsOfTracksFarFromAllCellsOrFromTheCorner) {
  Model model = model_at(CurbFrame{});
  const auto warning = [&](double x_m) { return warning_of_another_place(model, walk(x_m)); };
  EXPECT_EQ(warning(400), "");
  EXPECT_TRUE(says(warning(1299), "the tracks lie 1.3 km from the corner of the scene"));
  model.primitives.push_back({{{{0, 0}, Vector2::UnitX()}, {{1000, 0}, Vector2::UnitX()}}});
  EXPECT_EQ(warning(1299), "");
  EXPECT_TRUE(says(warning(-2000), "2.0 km from what the model has learnt: is it another place?"));
  EXPECT_EQ(warning_of_another_place(model, {}), "");
}

TEST(ModelScene, WarnsOfACornerThatMayBeASiteMeasuredAgain) {
  const CurbFrame frame = frame_of_tracks(walk(5));
  const Model model = model_at(frame);
  Scene scene = scene_of(model);
  EXPECT_EQ(warning_of_moved_corner(model, scene), "");
  Corner& corner = scene.corners.front();
  corner.frame.origin_m += Vector2(0.0, 3.0);
  const std::string warning = warning_of_moved_corner(model, scene);
  EXPECT_TRUE(says(warning, R"(corner "1" of the scene is 3 m from that of site 1)"));
  scene.corners.push_back(scene_of(model).corners.front());  // two corners that are near each other
  EXPECT_EQ(warning_of_moved_corner(model, scene), "");
  scene.corners.pop_back();
  scene.corners.front().frame.origin_m += Vector2(0.0, 3.0);
  EXPECT_EQ(warning_of_moved_corner(model, scene), "");
}

TEST(ModelScene, OfAnEmptyModelCannotBeShown) {
  EXPECT_THROW(scene_of(Model{}), std::invalid_argument);
  EXPECT_TRUE(says(rejection({}, {}), "no scene and no track"));
}

TEST(ModelScene, MarkOfAFrameMadeFromTracksIsStored) {
  CurbFrame frame = frame_of_tracks(walk(5));
  EXPECT_TRUE(unpack<CurbFrame>(pack(frame)).from_tracks);
  frame.from_tracks = false;
  EXPECT_FALSE(unpack<CurbFrame>(pack(frame)).from_tracks);
  std::vector<double> numbers = pack(frame);
  numbers.push_back(2.0);
  EXPECT_THROW(unpack<CurbFrame>(numbers), std::invalid_argument);
}

}  // namespace
}  // namespace sila
