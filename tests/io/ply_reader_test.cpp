#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

const Points kTwoPoints = {{1.5, -2.25, 3.0}, {4.0, 5.5, -6.75}};

std::string header(const std::string& format, const std::string& elements) {
  return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n";
}

const std::string kTwoFloatVertices =
    "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n";

TEST(PlyReader, ReadsAscii) {
  const TestDirectory directory;
  const auto path =
      directory.write("a.ply", header("ascii", kTwoFloatVertices) + "1.5 -2.25 3\n4 5.5 -6.75\n");
  const auto reader = open_point_cloud(path);
  EXPECT_EQ(reader->info().format, "PLY ascii");
  EXPECT_EQ(reader->info().num_points, 2u);
  expect_points(read_rest(*reader), kTwoPoints);
}

TEST(PlyReader, ReadsFloatsInBothByteOrders) {
  const TestDirectory directory;
  for (const auto& [name, order] :
       {std::pair{"little", std::endian::little}, std::pair{"big", std::endian::big}}) {
    const std::string format = std::string("binary_") + name + "_endian";
    const auto path =
        directory.write("b.ply", header(format, kTwoFloatVertices) +
                                     raw_list({1.5f, -2.25f, 3.0f, 4.0f, 5.5f, -6.75f}, order));
    const auto reader = open_point_cloud(path);
    EXPECT_EQ(reader->info().format, "PLY " + format);
    expect_points(read_rest(*reader), kTwoPoints);
  }
}

TEST(PlyReader, KeepsEveryBitOfDoubles) {
  const TestDirectory directory;
  const Vector3 utm(691234.123456789, 5334567.987654321, 512.0000001);
  const auto path =
      directory.write("d.ply", header("binary_big_endian",
                                      "element vertex 1\nproperty double x\nproperty float64 y\n"
                                      "property double z\n") +
                                   raw_list({utm.x(), utm.y(), utm.z()}, std::endian::big));
  expect_points(read_points(path), {utm});
}

TEST(PlyReader, ReadsIntegerCoordinatesOfEveryType) {
  const TestDirectory directory;
  const auto expect = [&](const std::string& type, const std::string& values, const Vector3& p) {
    const auto path = directory.write(
        "i.ply",
        header("binary_little_endian", "element vertex 1\nproperty " + type + " x\nproperty " +
                                           type + " y\nproperty " + type + " z\n") +
            values);
    SCOPED_TRACE(type);
    expect_points(read_points(path), {p});
  };
  expect("char", raw_list<std::int8_t>({-128, 0, 127}), {-128, 0, 127});
  expect("uint8", raw_list<std::uint8_t>({1, 128, 255}), {1, 128, 255});
  expect("short", raw_list<std::int16_t>({-32768, 1, 32767}), {-32768, 1, 32767});
  expect("ushort", raw_list<std::uint16_t>({0, 1, 65535}), {0, 1, 65535});
  expect("int", raw_list<std::int32_t>({-2000000000, 1, 2}), {-2000000000, 1, 2});
  expect("uint32", raw_list<std::uint32_t>({4000000000u, 1, 2}), {4000000000, 1, 2});
}

TEST(PlyReader, FindsCoordinatesByNameAmongOtherProperties) {
  const TestDirectory directory;
  const auto path = directory.write(
      "n.ply", header("binary_little_endian",
                      "element vertex 1\nproperty uchar red\nproperty float Z\n"
                      "property double nx\nproperty short X\nproperty float y\n") +
                   raw(std::uint8_t{9}) + raw(3.0f) + raw(0.5) + raw(std::int16_t{1}) + raw(2.0f));
  expect_points(read_points(path), {{1, 2, 3}});
}

TEST(PlyReader, ReadsListsBeforeAndBetweenTheCoordinates) {
  const TestDirectory directory;
  const std::string vertex =
      "element vertex 2\nproperty list uchar int parts\nproperty float x\nproperty float y\n"
      "property list ushort double more\nproperty float z\n";
  const std::string binary = raw(std::uint8_t{2}) + raw_list({7, 8}) + raw_list({1.5f, -2.25f}) +
                             raw(std::uint16_t{0}) + raw(3.0f) + raw(std::uint8_t{0}) +
                             raw_list({4.0f, 5.5f}) + raw(std::uint16_t{1}) + raw(9.0) +
                             raw(-6.75f);
  expect_points(
      read_points(directory.write("l.ply", header("binary_little_endian", vertex) + binary)),
      kTwoPoints);
  expect_points(read_points(directory.write(
                    "m.ply", header("ascii", vertex) + "2 7 8 1.5 -2.25 0 3\n0 4 5.5 1 9 -6.75\n")),
                kTwoPoints);
}

TEST(PlyReader, PassesOverElementsBeforeTheVertices) {
  const TestDirectory directory;
  const std::string before =
      "element nothing 5\nelement camera 2\nproperty float x\nproperty uchar y\n"
      "element face 2\nproperty list uchar short vertex_indices\nproperty uchar flag\n";
  const std::string binary = raw(1.0f) + "a" + raw(2.0f) + "b" + raw(std::uint8_t{1}) +
                             raw(std::int16_t{1}) + "f" + raw(std::uint8_t{0}) + "g" +
                             raw_list({1.5f, -2.25f, 3.0f, 4.0f, 5.5f, -6.75f});
  expect_points(read_points(directory.write(
                    "b.ply", header("binary_little_endian", before + kTwoFloatVertices) + binary)),
                kTwoPoints);
  expect_points(read_points(directory.write("a.ply", header("ascii", before + kTwoFloatVertices) +
                                                         "1 97\n\n2 98\n1 1 102\n0 103\n"
                                                         "1.5 -2.25 3\n4 5.5 -6.75\n")),
                kTwoPoints);
}

TEST(PlyReader, IgnoresElementsAndBytesBehindTheVertices) {
  const TestDirectory directory;
  const auto path = directory.write(
      "f.ply", header("ascii", kTwoFloatVertices +
                                   "element face 1\nproperty list uchar int vertex_indices\n") +
                   "1.5 -2.25 3\n4 5.5 -6.75\n3 0 1 1\nanything\n");
  expect_points(read_points(path), kTwoPoints);
}

TEST(PlyReader, ReadsHeadersWithCrLfCommentsAndObjInfo) {
  const TestDirectory directory;
  const auto path =
      directory.write("c.ply",
                      "ply\r\ncomment element vertex 7\r\nformat binary_little_endian 1.0\r\n"
                      "obj_info property float x\r\nelement vertex 1\r\nproperty float x\r\n\r\n"
                      "property float y\r\ncomment\r\nproperty float z\r\nend_header\r\n" +
                          raw_list({1.0f, 2.0f, 3.0f}));
  expect_points(read_points(path), {{1, 2, 3}});
}

TEST(PlyReader, ReadsAsciiWithCrLfBlankLinesAndNoFinalNewline) {
  const TestDirectory directory;
  const auto path = directory.write(
      "a.ply", header("ascii", kTwoFloatVertices) + "\r\n 1.5\t-2.25  +3e0 \r\n\r\n4 5.5 -6.75");
  expect_points(read_points(path), kTwoPoints);
}

TEST(PlyReader, KeepsNotANumberAndInfinity) {
  const TestDirectory directory;
  const double nan = std::nan(""), inf = HUGE_VAL;
  const Points expected = {{nan, inf, -inf}, {nan, 1, 2}};
  expect_points(read_points(directory.write(
                    "a.ply", header("ascii", kTwoFloatVertices) + "nan inf -inf\n-NaN 1 2\n")),
                expected);
  const auto nan_float = std::nanf(""), inf_float = HUGE_VALF;
  expect_points(
      read_points(directory.write(
          "b.ply", header("binary_little_endian", kTwoFloatVertices) +
                       raw_list({nan_float, inf_float, -inf_float, nan_float, 1.0f, 2.0f}))),
      expected);
}

TEST(PlyReader, ReadsAnEmptyCloud) {
  const TestDirectory directory;
  for (const std::string format : {"ascii", "binary_little_endian"}) {
    const auto path = directory.write(
        "e.ply",
        header(format, "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n"));
    const auto reader = open_point_cloud(path);
    EXPECT_EQ(reader->info().num_points, 0u);
    EXPECT_TRUE(read_rest(*reader).empty());
  }
}

TEST(PlyReader, GivesTheSamePointsForAnySpan) {
  const TestDirectory directory;
  constexpr std::size_t kCount = 100'000;  // several buffers long
  std::string body;
  Points expected;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto v = static_cast<float>(i);
    body += raw_list({v, v + 0.5f, -v}) + "rgb";
    expected.emplace_back(v, v + 0.5f, -v);
  }
  const auto path = directory.write(
      "s.ply",
      header("binary_little_endian",
             "element vertex " + std::to_string(kCount) +
                 "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
                 "property uchar green\nproperty uchar blue\n") +
          body);
  for (const std::size_t span : {std::size_t{1}, std::size_t{777}, kCount + 1}) {
    expect_points(read_points(path, span), expected);
  }
}

TEST(PlyReader, RefusesACountThatTheFileCannotHold) {
  const TestDirectory directory;
  const auto with_count = [&](const std::string& format, const std::string& count) {
    return directory.write("c.ply", header(format, "element vertex " + count +
                                                       "\nproperty float x\nproperty float y\n"
                                                       "property float z\n") +
                                        std::string(24, '1'));
  };
  const auto expect_refused_at_opening = [](const std::filesystem::path& path,
                                            const std::string& part) {
    const Error error = error_of([&] { static_cast<void>(open_point_cloud(path)); });
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  };
  expect_refused_at_opening(with_count("binary_little_endian", "3"), "declares 3 points");
  expect_refused_at_opening(with_count("binary_little_endian", "3"), "only 24 bytes");
  expect_refused_at_opening(with_count("binary_big_endian", "18446744073709551615"),
                            "declares 18446744073709551615 points");
  expect_refused_at_opening(with_count("ascii", "1000000000"), "declares 1000000000 points");
}

TEST(PlyReader, RefusesAPrecedingElementThatTheFileCannotHold) {
  const TestDirectory directory;
  for (const std::string format : {"ascii", "binary_little_endian"}) {
    expect_corrupt(
        directory.write("p.ply", header(format,
                                        "element face 4000000000\nproperty list uchar int i\n"
                                        "element vertex 1\nproperty float x\nproperty float y\n"
                                        "property float z\n") +
                                     "0 0 0\n"),
        "face");
  }
}

TEST(PlyReader, SaysWhichVertexOfAnAsciiFileIsMissingOrDamaged) {
  const TestDirectory directory;
  const std::string two = header("ascii", kTwoFloatVertices);
  expect_corrupt(directory.write("t.ply", two + "1 2 3        \n"), "vertex 2 of 2: file ends");
  expect_corrupt(directory.write("s.ply", two + "1 2 3\n4 5\n"), "vertex 2 of 2: line ends");
  expect_corrupt(directory.write("n.ply", two + "1 2 3\n4 5 6x\n"),
                 "vertex 2 of 2: '6x' is not a number");
}

TEST(PlyReader, SaysWhichVertexWithListsIsTruncated) {
  const TestDirectory directory;
  const std::string vertex =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property list int int parts\n";
  const std::string first = raw_list({1.0f, 2.0f, 3.0f});
  const std::string text = header("binary_little_endian", vertex);
  expect_corrupt(directory.write("t.ply", text + first + raw_list({6, 1, 2, 3, 4, 5})),
                 "vertex 1 of 2");
  expect_corrupt(directory.write("n.ply", text + first + raw(-1) + first + raw(0)),
                 "vertex 1 of 2");
}

TEST(PlyReader, RefusesDamagedHeaders) {
  const TestDirectory directory;
  const auto expect = [&](const std::string& text, const std::string& part) {
    SCOPED_TRACE(text);
    expect_corrupt(directory.write("h.ply", text), part);
  };
  expect("ply\nformat ascii 1.0\nelement vertex 0\n", "file ends inside the PLY header");
  expect("ply\nformat binary 1.0\nend_header\n", "line 2: unknown format 'binary'");
  expect("ply\nelement vertex 0\nend_header\n", "no format line");
  expect(header("ascii", ""), "no element vertex");
  expect(header("ascii", "element vertex -1\n"), "'-1' is not a number of elements");
  expect(header("ascii", "property float x\n"), "line 3: a property before the first element");
  expect(header("ascii", "element vertex 0\nproperty real x\n"), "unknown type 'real'");
  expect(header("ascii", "element vertex 0\nproperty float x\nproperty float y\n"),
         "no property z");
  expect(header("ascii", "element vertex 0\nproperty list float int x\n"), "not an integer");
  expect(header("ascii",
                "element vertex 0\nproperty list int int x\nproperty int y\n"
                "property int z\n"),
         "x is a list");
  expect(header("ascii", "elemen\x01t vertex 1\n"), "unknown keyword 'elemen?t'");
}

TEST(PlyReader, RefusesHeadersWithoutEnd) {
  const TestDirectory directory;
  expect_corrupt(directory.write("l.ply", "ply\ncomment " + std::string(1 << 20, 'c')),
                 "longer than");
  std::string many = "ply\nformat ascii 1.0\nelement vertex 1\n";
  for (int i = 0; i < 5000; ++i) many += "property float p" + std::to_string(i) + "\n";
  expect_corrupt(directory.write("p.ply", many), "more than 4096 properties");
  std::string comments = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 20'000; ++i) comments += "comment " + std::string(60, 'c') + "\n";
  expect_corrupt(directory.write("c.ply", comments), "the header is longer than 1 MiB");
}

}  // namespace
}  // namespace gdfmap::io_test
