#include "e2e/program.hpp"

#include <array>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

namespace gdfmap::test {
namespace {

constexpr unsigned kNobody = 65534;

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

/// Both ends of a pipe; what is still open is closed in the end.
class Pipe {
 public:
  Pipe() {
    if (::pipe2(ends_.data(), O_CLOEXEC) != 0) fail("pipe");
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  [[nodiscard]] int reading() const { return ends_[0]; }
  [[nodiscard]] int writing() const { return ends_[1]; }
  void close_reading() { close_end(0); }
  void close_writing() { close_end(1); }

 private:
  void close_end(std::size_t i) {
    if (ends_[i] >= 0) ::close(ends_[i]);
    ends_[i] = -1;
  }

  std::array<int, 2> ends_ = {-1, -1};
};

/// Replaces the forked child by the program; 127 when that is not possible.
[[noreturn]] void become(const Launch& launch, const Pipe& input, const Pipe& output,
                         const Pipe& error) {
  ::dup2(input.reading(), STDIN_FILENO);
  ::dup2(output.writing(), STDOUT_FILENO);
  ::dup2(error.writing(), STDERR_FILENO);
  for (const auto& [name, value] : launch.environment) ::setenv(name.c_str(), value.c_str(), 1);
  if (launch.unprivileged &&
      (::setgroups(0, nullptr) != 0 || ::setgid(kNobody) != 0 || ::setuid(kNobody) != 0)) {
    ::_exit(127);
  }
  std::vector<char*> arguments = {const_cast<char*>(launch.program.c_str())};
  for (const std::string& argument : launch.arguments) {
    arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  ::execv(launch.program.c_str(), arguments.data());
  ::_exit(127);
}

/// Appends what is there to read; false at the end.
bool receive(int descriptor, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t count = ::read(descriptor, buffer.data(), buffer.size());
  if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
  return count > 0;
}

/// Feeds and drains the program until it has closed its outputs.
void talk(const Launch& launch, Pipe& input, Pipe& output, Pipe& error, Result& result) {
  std::size_t num_sent = 0;
  if (launch.input.empty()) input.close_writing();
  while (output.reading() >= 0 || error.reading() >= 0) {
    std::array<pollfd, 3> polled = {pollfd{input.writing(), POLLOUT, 0},
                                    pollfd{output.reading(), POLLIN, 0},
                                    pollfd{error.reading(), POLLIN, 0}};
    if (::poll(polled.data(), polled.size(), -1) < 0) fail("poll");
    if (polled[0].revents != 0) {
      const ssize_t count =
          ::write(input.writing(), launch.input.data() + num_sent, launch.input.size() - num_sent);
      num_sent += count > 0 ? static_cast<std::size_t>(count) : 0;
      if (count < 0 || num_sent == launch.input.size()) input.close_writing();
    }
    if (polled[1].revents != 0) {
      const bool more = receive(output.reading(), result.out);
      if (!more || (launch.read_at_most && result.out.size() >= *launch.read_at_most)) {
        output.close_reading();
      }
    }
    if (polled[2].revents != 0 && !receive(error.reading(), result.err)) error.close_reading();
  }
}

/// Kills a process after a time, unless it is destroyed before: destroy it before the process is
/// waited for, whose number may then become another's.
class Killer {
 public:
  Killer(pid_t process, std::optional<std::chrono::microseconds> after) {
    if (!after) return;
    thread_ = std::thread([this, process, after = *after] {
      std::unique_lock lock(mutex_);
      if (!ended_.wait_for(lock, after, [this] { return has_ended_; })) ::kill(process, SIGKILL);
    });
  }
  ~Killer() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      has_ended_ = true;
    }
    ended_.notify_one();
    thread_.join();
  }
  Killer(const Killer&) = delete;
  Killer& operator=(const Killer&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool has_ended_ = false;
  std::thread thread_;
};

}  // namespace

Result run(const Launch& launch) {
  std::signal(SIGPIPE, SIG_IGN);  // a program may end before it has read its input
  Pipe input, output, error;
  const pid_t child = ::fork();
  if (child < 0) fail("fork");
  if (child == 0) {
    std::signal(SIGPIPE, SIG_DFL);
    become(launch, input, output, error);
  }
  input.close_reading();
  output.close_writing();
  error.close_writing();
  Result result;
  {
    const Killer killer(child, launch.kill_after);
    talk(launch, input, output, error, result);
  }
  input.close_writing();
  int status = 0;
  if (::waitpid(child, &status, 0) != child) fail("waitpid");
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

Result gdfmap(std::vector<std::string> arguments, std::string input) {
  Launch launch;
  launch.program = GDFMAP_PROGRAM;
  launch.arguments = std::move(arguments);
  launch.input = std::move(input);
  return run(launch);
}

Result gdfmap_until(const std::string& failpoint, std::vector<std::string> arguments) {
  Launch launch;
  launch.program = GDFMAP_PROGRAM_WITH_FAILPOINTS;
  launch.arguments = std::move(arguments);
  launch.environment = {{"GDFMAP_FAILPOINT", failpoint}};
  return run(launch);
}

}  // namespace gdfmap::test
