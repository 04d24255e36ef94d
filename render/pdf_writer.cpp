#include <fmt/format.h>

#include <string>
#include <vector>

#include "render/image.h"

namespace substep::render {
namespace {

/// The compressed rows of a PNG of 8-bit RGB that is not interlaced, which PDF knows too.
std::string compressed_rows(const std::string& png) {
  const auto number = [&png](std::size_t at) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(png.at(at + i));
    return value;
  };
  std::string rows;
  constexpr std::size_t signature = 8;
  constexpr std::size_t around = 12;  // length, kind and checksum of a chunk
  for (std::size_t at = signature; at + around <= png.size(); at += around + number(at)) {
    if (png.compare(at + 4, 4, "IDAT") == 0) rows += png.substr(at + 8, number(at));
  }
  return rows;
}

}  // namespace

std::string to_pdf(const Image& image, double width) {
  const double points = width / 25.4 * 72;
  const double height = points * image.height / image.width;
  const std::string rows = compressed_rows(to_png(image));
  const std::string drawing = fmt::format("q {:.4f} 0 0 {:.4f} 0 0 cm /I Do Q", points, height);
  const std::vector<std::string> objects{
      "<</Type/Catalog/Pages 2 0 R>>", "<</Type/Pages/Kids[3 0 R]/Count 1>>",
      fmt::format("<</Type/Page/Parent 2 0 R/MediaBox[0 0 {:.4f} {:.4f}]/Contents 4 0 R"
                  "/Resources<</XObject<</I 5 0 R>>>>>>",
                  points, height),
      fmt::format("<</Length {}>>\nstream\n{}\nendstream", drawing.size(), drawing),
      fmt::format("<</Type/XObject/Subtype/Image/Width {0}/Height {1}/ColorSpace/DeviceRGB/BitsPerComponent 8"
                  "/Filter/FlateDecode/DecodeParms<</Predictor 15/Colors 3/Columns {0}>>/Length {2}>>\n"
                  "stream\n{3}\nendstream",
                  image.width, image.height, rows.size(), rows)};
  std::string file = "%PDF-1.4\n%\xe2\xe3\xcf\xd3\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010} 00000 n \n", file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  return fmt::format("{}{}trailer\n<</Size {}/Root 1 0 R>>\nstartxref\n{}\n%%EOF\n", file, table,
                     objects.size() + 1, file.size());
}

}  // namespace substep::render
