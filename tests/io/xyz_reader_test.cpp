#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

const Points kTwoPoints = {{1.5, -2.25, 3.0}, {4.0, 5.5, -6.75}};

class XyzReader : public ::testing::Test {
 protected:
  void expect(const std::string& text, const Points& points) {
    SCOPED_TRACE(text);
    expect_points(read_points(directory_.write("t.xyz", text)), points);
  }
  void expect_refused(const std::string& text, const std::string& part) {
    SCOPED_TRACE(text);
    expect_corrupt(directory_.write("t.xyz", text), part);
  }

  TestDirectory directory_;
};

constexpr const char* kNoCloud =
    "not a point cloud in a format that gdfmap reads (PLY, PCD, LAS, XYZ)";

TEST_F(XyzReader, ReadsEverySeparator) {
  expect("1.5 -2.25 3\n4 5.5 -6.75\n", kTwoPoints);
  expect("1.5\t-2.25\t3\n4\t5.5\t-6.75\n", kTwoPoints);
  expect("1.5,-2.25,3\n4,5.5,-6.75\n", kTwoPoints);
  expect("1.5;-2.25;3\n4;5.5;-6.75\n", kTwoPoints);
  expect("  1.5 , -2.25,\t3 \n4 ,5.5  ,  -6.75,\n", kTwoPoints);
}

TEST_F(XyzReader, DeclaresNoCount) {
  const auto reader = open_point_cloud(directory_.write("n.csv", "1 2 3\n"));
  EXPECT_EQ(reader->info().format, "XYZ");
  EXPECT_EQ(reader->info().num_points, std::nullopt);
}

TEST_F(XyzReader, TakesTheFirstThreeOfMoreColumns) {
  expect("1.5 -2.25 3 255 0 n/a\n4 5.5 -6.75\n", kTwoPoints);
}

TEST_F(XyzReader, FindsTheColumnsThatAHeaderNames) {
  expect("id,Z,\"x\",Y\n1,3,1.5,-2.25\n2,-6.75,4,5.5\n", kTwoPoints);
  expect("t x y z\n0.1 1.5 -2.25 3\n0.2 4 5.5 -6.75\n", kTwoPoints);
  expect("\xef\xbb\xbfX;Y;Z\r\n1.5;-2.25;3\r\n4;5.5;-6.75\r\n", kTwoPoints);
  expect("x,y,z\n", {});
}

TEST_F(XyzReader, PassesOverAHeaderThatDoesNotNameThem) {
  expect("easting northing height\n1.5 -2.25 3\n4 5.5 -6.75\n", kTwoPoints);
}

TEST_F(XyzReader, PassesOverCommentsAndBlankLines) {
  expect("# made by hand\n\n// second\n1.5 -2.25 3\n   # third\n \t\n4 5.5 -6.75", kTwoPoints);
}

TEST_F(XyzReader, FindsTheColumnsThatACommentNames) {
  expect("# time x y z\n9 1.5 -2.25 3\n9 4 5.5 -6.75\n", kTwoPoints);
  expect("//X,Y,Z,R\n1.5,-2.25,3,7\n4,5.5,-6.75,7\n", kTwoPoints);
  // Prose with the same letters has another number of words.
  expect("# turned z into x and y\n1.5 -2.25 3\n4 5.5 -6.75\n", kTwoPoints);
}

TEST_F(XyzReader, KeepsEveryBitAndEverySpecialValue) {
  expect("691234.123456789 5334567.987654321 1e-300\nnan inf -inf\n+1 .5 -5.\n",
         {{691234.123456789, 5334567.987654321, 1e-300},
          {std::nan(""), HUGE_VAL, -HUGE_VAL},
          {1, 0.5, -5}});
}

TEST_F(XyzReader, NamesTheLineThatIsMalformed) {
  expect_refused("1 2 3\n\n4 5x 6\n", "t.xyz: line 3, column 2: '5x' is not a number");
  expect_refused("# c\n1 2 3\n4 5\n", "line 3, column 3: there is no number");
  expect_refused("1,2,3\n1,,3\n", "line 2, column 2: there is no number");
  expect_refused("1 2\n1 2 3\n", "line 1, column 3: there is no number");
  expect_refused("x y z\n1 2 three\n", "line 2, column 3: 'three' is not a number");
  expect_refused("1 2 0x10\n", "'0x10' is not a number");
  expect_refused("1 2 3\n1 2 +-3\n", "'+-3' is not a number");
}

TEST_F(XyzReader, RefusesDecimalCommas) {
  expect_refused("x;y;z\n1,5;2,5;3,5\n", "line 2, column 1: '1,5' is not a number");
  expect_refused("1,5;2,5;3,5\n", kNoCloud);
}

TEST_F(XyzReader, RefusesWhatIsNoPointCloud) {
  expect_refused("Dear reader,\nthis is a letter.\n", kNoCloud);
  expect_refused("{\"type\": \"json\"}\n", kNoCloud);
  expect_refused("# only a comment\n\n", kNoCloud);
  expect_refused("\n \n", kNoCloud);
  expect_refused(std::string("\x7f"
                             "ELF\x02\x01\0\0\0",
                             9),
                 kNoCloud);
  expect_refused(std::string("1 2 3\n\0\0\0\0", 10), kNoCloud);
}

TEST_F(XyzReader, RefusesALineWithoutEnd) {
  expect_refused("1 2 3\n" + std::string(1 << 20, ' '), "longer than");
}

TEST_F(XyzReader, ReadsMoreThanOneBuffer) {
  std::string text;
  Points points;
  for (int i = 0; i < 200'000; ++i) {
    text += std::to_string(i) + ", -" + std::to_string(i) + ".25, 0.5\n";
    points.emplace_back(i, -i - 0.25, 0.5);
  }
  points[0].y() = -0.25;
  const auto path = directory_.write("long.csv", text);
  for (const std::size_t span : {1u, 1000u}) expect_points(read_points(path, span), points);
}

}  // namespace
}  // namespace gdfmap::io_test
