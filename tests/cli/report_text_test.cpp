// Texts of tables, scripts and pages.
#include <blockid/cli/outputs.hpp>
#include <blockid/cli/report/gnuplot.hpp>
#include <blockid/cli/report/html.hpp>
#include <blockid/cli/report/script.hpp>
#include <blockid/cli/text_table.hpp>
#include <blockid/data/error.hpp>

#include "support/temp_dir.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

namespace {

using namespace blockid::cli;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Numbers, AreShortAndIndependentOfTheLocale) {
  EXPECT_EQ(number(0.25), "0.25");
  EXPECT_EQ(number(51200.0), "51200");
  EXPECT_EQ(number(1.0 / 3.0, 3), "0.333");
  EXPECT_EQ(number(-1.5e-9), "-1.5e-09");
  EXPECT_EQ(number(std::nan("")), "nan");
  EXPECT_EQ(number(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(fixed_number(2.0, 2), "2.00");
  EXPECT_EQ(with_unit("3", "V"), "3 V");
  EXPECT_EQ(with_unit("3", ""), "3");
}

TEST(TextTable, ColumnsLineUp) {
  using Align = TextTable::Align;
  std::ostringstream stream;
  print(stream, {{{"name", Align::left}, {"value", Align::right}}, {{"b", "12.5"}, {"Länge", "3"}}});
  EXPECT_EQ(stream.str(), "  name   value\n  b       12.5\n  Länge      3\n");
}

TEST(Script, StringsCannotLeaveTheirQuotes) {
  EXPECT_EQ(plot_text("a'b\nc"), "'a''b c'");
  EXPECT_EQ(axis_label("y", "V"), "y [V]");
  EXPECT_EQ(axis_label("y", ""), "y");
  VectorXd x(2);
  x << 1.5, std::nan("");
  EXPECT_EQ(data_block("d", {x, x}), "$d << EOD\n1.5 1.5\nNaN NaN\nEOD\n");
}

TEST(Html, TextIsEscaped) {
  EXPECT_EQ(escaped("a<b & \"c\"'"), "a&lt;b &amp; &quot;c&quot;&#39;");
  HtmlPage page("<title>");
  page.heading("h&h");
  page.table({"name", "value"}, {{"x", "1"}, {"y", "<2>"}});
  page.warning("w<");
  page.figure("f", "Title", "<svg></svg>", "cap<tion", 500);
  const std::string text = page.text();
  EXPECT_THAT(text, HasSubstr("&lt;title&gt;"));
  EXPECT_THAT(text, HasSubstr("h&amp;h"));
  EXPECT_THAT(text, HasSubstr("&lt;2&gt;"));
  EXPECT_THAT(text, HasSubstr("<svg></svg>"));
  EXPECT_THAT(text, HasSubstr("cap&lt;tion"));
  EXPECT_THAT(text, Not(HasSubstr("http")));
}

TEST(Gnuplot, PicturesFitIntoAPage) {
  const std::string svg = inline_svg(
      "<?xml version=\"1.0\"?>\n<!DOCTYPE svg PUBLIC \"-//W3C//DTD SVG 1.1//EN\" \"http://www.w3.org/x.dtd\">\n"
      "<svg viewBox=\"0 0 9 9\" xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\">\n"
      "<desc>made</desc>\n<path id='gpDot' d='M0'/><use xlink:href='#gpDot'/><g fill=\"url(#grey)\" "
      "id=\"plot_1\"/></svg>",
      "pic");
  EXPECT_EQ(
      svg,
      "<svg viewBox=\"0 0 9 9\">\n<path id='pic-gpDot' d='M0'/><use href='#pic-gpDot'/><g fill=\"url(#pic-grey)\" "
      "id=\"pic-plot_1\"/></svg>");
  EXPECT_THROW(inline_svg("nothing", "pic"), blockid::Error);
}

TEST(Gnuplot, PicturesStandAlone) {
  const std::string svg = document_svg(
      "<?xml version=\"1.0\"?>\n<!DOCTYPE svg PUBLIC \"-//W3C//DTD SVG 1.1//EN\" \"http://www.w3.org/x.dtd\">\n"
      "<svg xmlns=\"http://www.w3.org/2000/svg\">\n<title>Gnuplot</title>\n<desc>made</desc>\n</svg>",
      "f < $1 & g");
  EXPECT_EQ(svg,
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\">\n"
            "<title>f &lt; $1 &amp; g</title>\n</svg>");
  EXPECT_EQ(document_svg("<svg>\n</svg>", "t"),
            "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<svg><title>t</title>\n</svg>");
  EXPECT_THROW(document_svg("nothing", "t"), blockid::Error);
}

TEST(Gnuplot, DrawsOrSaysWhyNot) {
  if (!gnuplot_is_there()) GTEST_SKIP() << kGnuplotMissing;
  const std::string svg =
      gnuplot_svg("set title " + plot_text("it's `date` $(date) <&>") + "\nplot x\n", "p", 300, 200);
  EXPECT_EQ(svg.rfind("<svg", 0), 0u);
  EXPECT_THAT(svg, HasSubstr("it's `date` $(date) &lt;&amp;"));
  EXPECT_THAT(svg, Not(HasSubstr("http")));
  try {
    gnuplot_svg("plot nonsense(x)\n", "p", 300, 200);
    FAIL() << "a wrong script";
  } catch (const blockid::Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("nonsense"));
    EXPECT_THAT(error.what(), HasSubstr("exit code"));
  }
}

TEST(Outputs, JsonHasNullForWhatIsNotFinite) {
  const nlohmann::ordered_json value = {{"a", std::nan("")}, {"b", std::numeric_limits<double>::infinity()}};
  EXPECT_EQ(nlohmann::json::parse(json_text(value)).dump(), "{\"a\":null,\"b\":null}");
  EXPECT_NO_THROW(nlohmann::json::parse(json_text({{"name", "\xff\xfe"}})));
}

TEST(Outputs, AreCheckedBeforehand) {
  const blockid::testing::TempDir folder;
  EXPECT_NO_THROW(check_outputs({(folder / "a").string(), "", (folder / "b").string(), "/dev/null", "/dev/null"}));
  EXPECT_THROW(check_outputs({(folder / "no/a").string()}), OutputError);
  EXPECT_THROW(check_outputs({folder.path().string()}), OutputError);
  EXPECT_THROW(check_outputs({(folder / "a").string(), (folder / "./a").string()}), blockid::Error);
  EXPECT_THROW(write_output((folder / "no/a").string(), "x"), OutputError);
}

}  // namespace
