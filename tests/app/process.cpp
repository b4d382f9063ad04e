#include <app/process.h>
#include <gtest/gtest.h>
#include <scene/level_file.h>
#include <spawn.h>
#include <sys/wait.h>

#include <fcntl.h>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

namespace dimmer::test {
namespace {

class Process {
   public:
    Process(const std::string& program, const std::vector<std::string>& arguments, const std::string& input) {
        const auto in = folder_.write("in", input.data(), input.size());
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        posix_spawn_file_actions_addopen(&files, 0, in.c_str(), O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&files, 1, out_.c_str(), O_WRONLY | O_CREAT, 0600);
        posix_spawn_file_actions_addopen(&files, 2, err_.c_str(), O_WRONLY | O_CREAT, 0600);
        // Shells have their background jobs ignore SIGINT, `nohup` SIGHUP and Python SIGPIPE, and so it would be passed
        // on from the tests.
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        sigset_t signals;
        sigemptyset(&signals);
        for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaddset(&signals, signal);
        posix_spawnattr_setsigdefault(&attributes, &signals);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
        std::vector<char*> argv = {const_cast<char*>(program.c_str())};
        for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
        argv.push_back(nullptr);
        started_ = posix_spawn(&id_, program.c_str(), &files, &attributes, argv.data(), environ) == 0;
        EXPECT_TRUE(started_) << program;
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&files);
    }
    bool running() { return started_ && !ended_ && !wait(WNOHANG); }
    void send(int signal) const { kill(id_, signal); }
    std::string err() const { return readText(err_); }
    ProcessResult result() {
        if (!started_ || (!ended_ && !wait(0))) return {};
        return {WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_), readText(out_), readText(err_)};
    }

   private:
    bool wait(int options) { return ended_ = waitpid(id_, &status_, options) == id_; }

    const cook::test::TemporaryFolder folder_;  // files instead of pipes: nothing can fill up and block
    const std::filesystem::path out_ = folder_.path / "out", err_ = folder_.path / "err";
    pid_t id_ = 0;
    bool started_ = false, ended_ = false;
    int status_ = 0;
};

}  // namespace

ProcessResult runProcess(const std::string& program, const std::vector<std::string>& arguments,
                         const std::string& input) {
    return Process(program, arguments, input).result();
}

std::string readText(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

ProcessResult runInterrupted(const std::string& program, const std::vector<std::string>& arguments, int signal,
                             const std::function<bool(const std::string& err)>& when) {
    Process process(program, arguments, "");
    for (bool sent = false; !sent && process.running();) {
        if (sent = when(process.err()); sent) process.send(signal);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return process.result();
}

}  // namespace dimmer::test
