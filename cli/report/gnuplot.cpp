#include <blockid/cli/report/gnuplot.hpp>

#include <blockid/cli/report/html.hpp>

#include <blockid/data/atomic_file.hpp>
#include <blockid/data/error.hpp>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <system_error>
#include <vector>

namespace blockid::cli {
namespace {

namespace fs = std::filesystem;

/// Folder of its own under the system's temporary one, removed with all it holds.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (fs::temp_directory_path() / "blockid-plot-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      fail(name, ": cannot make a temporary folder: ", std::generic_category().message(errno));
    }
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

constexpr int kNotStarted = -1;
const std::string kPrologue = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";

/// Exit code of gnuplot with these arguments, kNotStarted when it cannot be run; what it says goes to `messages`.
int run_gnuplot(std::vector<std::string> arguments, const fs::path& messages) {
  arguments.insert(arguments.begin(), {"gnuplot", "--default-settings"});
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr mode_t kPrivate = 0600;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, messages.c_str(), O_WRONLY | O_CREAT | O_TRUNC, kPrivate);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, "gnuplot", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return kNotStarted;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return kNotStarted;
  }
  constexpr int kCommandNotFound = 127;
  if (!WIFEXITED(status)) return EXIT_FAILURE;
  return WEXITSTATUS(status) == kCommandNotFound ? kNotStarted : WEXITSTATUS(status);
}

/// What gnuplot makes of the script; `name` is for messages.
std::string drawn(const std::string& script, const std::string& name, int width, int height) {
  const ScratchFolder folder;
  const fs::path picture = folder / "picture.svg";
  const fs::path source = folder / "picture.gp";
  const fs::path messages = folder / "messages";
  std::ofstream(source) << "set terminal svg size " << width << "," << height
                        << " dynamic noenhanced font 'sans-serif,13' background 'white' linewidth 1\n"
                        << "set output '" << picture.string() << "'\n"
                        << script << "\nunset output\n";
  const int code = run_gnuplot({source.string()}, messages);
  if (code == kNotStarted) fail(kGnuplotMissing);
  if (code != 0 || !fs::exists(picture)) {
    fail("gnuplot failed on the picture '", name, "' with exit code ", code, ": ", read_file(messages));
  }
  return read_file(picture);
}

}  // namespace

bool gnuplot_is_there() {
  const ScratchFolder folder;
  return run_gnuplot({"--version"}, folder / "messages") == 0;
}

std::string inline_svg(const std::string& svg, const std::string& id) {
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string::npos) fail("gnuplot made no SVG picture");
  std::string text = svg.substr(begin);
  text = std::regex_replace(text, std::regex(" xmlns(:xlink)?=\"[^\"]*\""), "");
  text = std::regex_replace(text, std::regex("<desc>[^<]*</desc>\\n?"), "");
  text = std::regex_replace(text, std::regex("xlink:href="), "href=");
  text = std::regex_replace(text, std::regex("( id=['\"]| href=['\"]#|url\\(['\"]?#)"), "$1" + id + "-");
  return text;
}

std::string document_svg(const std::string& svg, const std::string& title) {
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string::npos) fail("gnuplot made no SVG picture");
  // The title may hold what a replacement format would take for a reference.
  const std::string text = std::regex_replace(svg.substr(begin), std::regex("<desc>[^<]*</desc>\\n?"), "");
  const std::regex own("<title>[^<]*</title>");
  std::smatch found;
  const std::string element = "<title>" + escaped(title) + "</title>";
  if (std::regex_search(text, found, own)) {
    return kPrologue + found.prefix().str() + element + found.suffix().str();
  }
  const std::size_t inside = text.find('>') + 1;
  return kPrologue + text.substr(0, inside) + element + text.substr(inside);
}

std::string gnuplot_svg(const std::string& script, const std::string& id, int width, int height) {
  return inline_svg(drawn(script, id, width, height), id);
}

std::string gnuplot_document(const std::string& script, const std::string& title, int width, int height) {
  return document_svg(drawn(script, title, width, height), title);
}

}  // namespace blockid::cli
