#include <atomic>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>

#include <gdfmap/core/failpoint.hpp>

// Linked into the program of the tests alone: GDFMAP_FAILPOINT=NAME:COUNT[:TERM[:TIMES]] raises
// SIGKILL, or SIGTERM that many times, when the program passes NAME for the COUNT-th time.

namespace {

struct Failpoint {
  std::string name;
  int count = 1;
  int signal = SIGKILL;
  int times = 1;
  std::atomic<int> num_passed = 0;

  Failpoint() {
    const char* const text = std::getenv("GDFMAP_FAILPOINT");
    if (text == nullptr) return;
    std::istringstream fields(text);
    std::string field;
    std::getline(fields, name, ':');
    if (std::getline(fields, field, ':')) count = std::stoi(field);
    if (std::getline(fields, field, ':') && field == "TERM") signal = SIGTERM;
    if (std::getline(fields, field, ':')) times = std::stoi(field);
    gdfmap::set_failpoint_handler(&Failpoint::pass);
  }

  static void pass(const char* passed);
};

Failpoint chosen;

void Failpoint::pass(const char* passed) {
  if (chosen.name != passed || ++chosen.num_passed != chosen.count) return;
  for (int i = 0; i < chosen.times; ++i) std::raise(chosen.signal);
}

}  // namespace
