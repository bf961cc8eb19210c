#include <gdfmap/io/poses.hpp>

#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

std::vector<Eigen::Isometry3d> read(const std::string& text) {
  const TestDirectory directory;
  return read_poses(directory.write("poses.txt", text));
}

Error refusal(const std::string& text) {
  try {
    static_cast<void>(read(text));
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "accepted: " << text;
  return {ErrorCode::kInternal, ""};
}

TEST(Poses, ReadsTheRowsOfKitti) {
  const auto poses = read(
      "1 0 0 0 0 1 0 0 0 0 1 0\n"
      "0.0e+00 -1 0 1.5   1 0 0 -2.5\t0 0 1 4512345.75\r\n");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_TRUE(poses[0].isApprox(Eigen::Isometry3d::Identity()));
  EXPECT_EQ(poses[1].translation(), Vector3(1.5, -2.5, 4512345.75));
  EXPECT_TRUE((poses[1].linear() * Vector3(1, 0, 0)).isApprox(Vector3(0, 1, 0)));
}

TEST(Poses, ReadsTumWithCommentsAndBlankLines) {
  const auto poses = read(
      "# ground truth trajectory\n"
      "# timestamp tx ty tz qx qy qz qw\n"
      "\n"
      "1305031102.1758 1.3405 0.6266 1.6575 0 0 0.7071 0.7071\n"
      "   \n"
      "1305031102.2758 -1 2 -3 0 0 0 -1");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].translation(), Vector3(1.3405, 0.6266, 1.6575));
  EXPECT_TRUE((poses[0].linear() * Vector3(1, 0, 0)).isApprox(Vector3(0, 1, 0)));
  EXPECT_TRUE(poses[1].linear().isIdentity());
}

TEST(Poses, MakesRoundedRotationsExact) {
  for (const std::string& text :
       {std::string("0.8 -0.60001 0 0 0.6 0.8 0 0 0 0 1 0"), std::string("0 0 0 0 0 0 .6001 .8")}) {
    const Eigen::Matrix3d R = read(text)[0].linear();
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14) << text;
  }
}

TEST(Poses, NamesTheLineThatItCannotUse) {
  const std::string good = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"1 2 3\n", "line 1: it has 3 columns"},
      {good + good + "1 2 3 4\n", "line 3: it has 4 columns"},
      {good + "0 1 2 3 0 0 0 1\n", "line 2: it has 8 columns, the lines before it have 12"},
      {"# a\n1 0 0 0 0 1 0 0 0 0 1 nan\n", "line 2: 'nan' is not a finite number"},
      {"1 0 0 0 0 1 0 0 0 0 1 1e999\n", "line 1: '1e999' is not a finite number"},
      {"1 0 0 0 0 1 0 0 0 0 1 x\n", "line 1: 'x' is not a finite number"},
      {good + "2 0 0 0 0 2 0 0 0 0 2 0\n", "line 2: the left 3 x 3 of its matrix is not"},
      {"1 0 0 0 0 1 0 0 0 0 -1 0\n", "line 1: the left 3 x 3 of its matrix is not"},
      {"1 0 0.01 0 0 1 0 0 0 0 1 0\n", "line 1: the left 3 x 3 of its matrix is not"},
      {"0 1 2 3 0 0 0 1.01\n", "line 1: its quaternion has length 1.010000"},
      {"0 1 2 3 0 0 0 0\n", "line 1: its quaternion has length 0.000000"},
      {"", "it holds no poses"},
      {"# nothing\n\n", "it holds no poses"}};
  for (const auto& [text, message] : cases) {
    const Error error = refusal(text);
    EXPECT_EQ(error.code(), ErrorCode::kUsage) << text;
    EXPECT_NE(std::string(error.what()).find("poses.txt: " + message), std::string::npos)
        << text << error.what();
  }
}

TEST(Poses, RefusesAFileThatIsNotThereAndALineWithoutEnd) {
  const TestDirectory directory;
  EXPECT_THROW(
      {
        try {
          static_cast<void>(read_poses(directory / "none.txt"));
        } catch (const Error& error) {
          EXPECT_EQ(error.code(), ErrorCode::kIo);
          throw;
        }
      },
      Error);
  EXPECT_EQ(refusal(std::string(std::size_t{1} << 20, '1')).code(), ErrorCode::kCorrupt);
}

}  // namespace
}  // namespace gdfmap::io_test
