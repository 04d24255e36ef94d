#include "render/report/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace substep::report {
namespace {

using testing::HasSubstr;
using testing::Not;

Document page() {
  Document document;
  document.heading(1, "Page");
  document.paragraph("1 < 2, **strong** and `code`");
  document.table({{"", "a|b"}, {{"row", "1"}}});
  document.picture("about", "figures/one.svg", "<svg a=\"1\">é</svg>");
  return document;
}

TEST(Document, IsMarkdown) {
  EXPECT_EQ(to_markdown(page()),
            "# Page\n\n1 < 2, **strong** and `code`\n\n|  | a\\|b |\n|---|---:|\n| row | 1 |\n\n"
            "![about](figures/one.svg)\n");
}

TEST(Document, IsOneHtmlFile) {
  const std::string html = to_html(page());
  EXPECT_THAT(html, HasSubstr("<title>Page</title>"));
  EXPECT_THAT(html, HasSubstr("<p>1 &lt; 2, <strong>strong</strong> and <code>code</code></p>"));
  EXPECT_THAT(html, HasSubstr("<th>a|b</th>"));
  EXPECT_THAT(html, HasSubstr("data:image/svg+xml;charset=utf-8,%3Csvg a=%221%22%3E%C3%A9%3C/svg%3E"));
  EXPECT_THAT(html, Not(HasSubstr("figures/one.svg")));
}

TEST(Document, KeepsWideTablesOnAPhone) {
  const std::string html = to_html(page());
  // Blanks in property names, which a formatter once put there, make browsers ignore them.
  const std::string style = html.substr(0, html.find("</style>"));
  EXPECT_THAT(style, HasSubstr(".table{overflow-x:auto}"));
  EXPECT_THAT(style, HasSubstr("@media(max-width:700px)"));
  EXPECT_THAT(style, Not(testing::ContainsRegex("[a-z] - [a-z]")));
}

}  // namespace
}  // namespace substep::report
