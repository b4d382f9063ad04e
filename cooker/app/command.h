// The command line: one function per subcommand, each in its own file, and what they share.
#pragma once

#include <dimmer/pack.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <string>
#include <string_view>

namespace dimmer::cook {

// The contract with scripts and pipelines.
enum ExitCode : int {
    exit_done = 0,
    exit_our_fault = 1,
    exit_bad_input = 2,
    exit_over_budget = 3,
    exit_above_max_error = 4,
};

// Each adds a subcommand whose callback stores the process's exit code.
void addCookCommand(CLI::App& app, int& exit_code);
void addInspectCommand(CLI::App& app, int& exit_code);
void addSampleCommand(CLI::App& app, int& exit_code);
void addBenchCommand(CLI::App& app, int& exit_code);
void addSynthCommand(CLI::App& app, int& exit_code);
void addVerifyCommand(CLI::App& app, int& exit_code);
void addReferenceCommand(CLI::App& app, int& exit_code);
void addExplainCommand(CLI::App& app, int& exit_code);
void addExportCommand(CLI::App& app, int& exit_code);
void addReportCommand(CLI::App& app, int& exit_code);
void addStressCommand(CLI::App& app, int& exit_code);

// After a usage error, which ends a cook before it looks at its files: what an earlier one wrote to --json goes, as far
// as the command line was understood.
void removeOldCookJson(const CLI::App& app);

// Prints the message to stderr; the exit code that belongs to it.
int reportError(const Error& error);
int exitCodeOf(ErrorCode code);

// To a file, or to stdout for "-".
Expected<void> writeJson(const nlohmann::ordered_json& json, const std::string& file);

// The HTML of report/report.h, to a file.
struct ReportInput;
Expected<void> writeReport(const Pack& pack, const ReportInput& input, const std::string& file);

// For CLI::Option::check(): its own checks of ranges let "nan" pass.
std::string refuseNotFinite(const std::string& text);
std::string refuseNoShare(const std::string& text);  // what is negative or not finite

}  // namespace dimmer::cook
