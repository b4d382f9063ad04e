// What goes to stderr. Where that is closed or full it is lost and the work goes on.
#pragma once

#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>

namespace dimmer::cook {

// The text as it is, at once.
void say(std::string_view text) noexcept;

// A message: every line of it on its own, behind "dimmer: ", so that it can be told from lines of progress.
void sayMessage(std::string_view message) noexcept;

void sayWarning(std::string_view warning);
void sayWarnings(std::span<const std::string> warnings);

// Tells warnings that come for the first time.
class WarningsOnce {
   public:
    bool isNew(std::string_view warning) { return said_.emplace(warning).second; }

   private:
    std::set<std::string, std::less<>> said_;
};

// Takes the places of standard streams that the caller closed, so that no file which is opened later gets one of their
// numbers and what is printed. Using them stays an error. To be called before any file is opened.
void keepClosedStreamsClosed() noexcept;

}  // namespace dimmer::cook
