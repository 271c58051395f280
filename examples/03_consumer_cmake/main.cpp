// Places a point in the frame of a corner, and inspects a model file if one is given:  consumer [model.sila]
#include <iostream>
#include <sila/core/curb_frame.hpp>
#include <sila/core/errors.hpp>
#include <sila/io/inspect.hpp>
#include <sila/version.hpp>

int main(int argc, char** argv) {
  const sila::Vector2 origin_m(10.0, 5.0);
  const sila::SidewalkWidths widths{2.0, 2.0, 2.0};
  const sila::CurbFrame corner = sila::make_curb_frame(origin_m, sila::Vector2::UnitX(), sila::Vector2::UnitY(), widths,
                                                       sila::CurbScaling::mean_width);
  const sila::Vector2 place = to_curb(corner, sila::Vector2(13.0, 4.0));
  std::cout << "sila " SILA_VERSION ": the point lies " << place.x() << " and " << place.y()
            << " sidewalk widths along the curbs\n";
  if (argc < 2) return 0;
  try {
    std::cout << sila::describe(sila::load_model(argv[1]));
  } catch (const sila::FormatError& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}
