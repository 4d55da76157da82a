#pragma once

#include <csignal>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace process {

/// Another program, whose words come through a pipe; killed if it still runs at the end.
class Process {
 public:
  explicit Process(std::vector<std::string> words, std::vector<std::string> environment = {}) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    out_ = ends[0];
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    std::vector<char*> env;
    for (std::string& word : environment) env.push_back(word.data());
    for (char** word = environ; *word != nullptr; ++word) env.push_back(*word);
    env.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, ends[1], STDOUT_FILENO);
    const int failed =
        posix_spawn(&pid_, words.front().c_str(), &files, nullptr, argv.data(), env.data());
    posix_spawn_file_actions_destroy(&files);
    close(ends[1]);
    if (failed != 0) throw std::runtime_error(words.front() + ": cannot be started");
  }
  ~Process() {
    if (pid_ > 0) static_cast<void>(kill());
    close_pipe();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// What it says next, up to the end of the line; short when it has ended or says nothing for
  /// long.
  [[nodiscard]] std::string line() {
    std::string text;
    char letter = 0;
    pollfd ready{.fd = out_, .events = POLLIN, .revents = 0};
    while (poll(&ready, 1, 60'000) == 1 && read(out_, &letter, 1) == 1 && letter != '\n')
      text += letter;
    return text;
  }
  /// Its exit code; 128 and the signal that ended it.
  int wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  int kill() {
    send(SIGKILL);
    return wait();
  }
  void send(int signal) { ::kill(pid_, signal); }
  /// From here on nobody listens.
  void close_pipe() {
    if (out_ >= 0) close(out_);
    out_ = -1;
  }

 private:
  pid_t pid_ = 0;
  int out_ = -1;
};

}  // namespace process
