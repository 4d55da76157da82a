#include "tools/starloop/plot_script.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

namespace starloop {

bool run_plot_script(const std::string& name, const std::string& path, const std::string& more) {
  std::string python = "/usr/bin/python3";
  std::string script = std::string(STARLOOP_SOURCE_DIR) + "/tools/plot/" + name;
  std::string where = path;
  std::string other = more;
  char* arguments[] = {python.data(), script.data(), where.data(),
                       other.empty() ? nullptr : other.data(), nullptr};
  pid_t child = 0;
  if (posix_spawn(&child, python.c_str(), nullptr, nullptr, arguments, environ) != 0) return false;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace starloop
