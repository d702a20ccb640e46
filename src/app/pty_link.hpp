#pragma once

#include <string>

namespace panelgate::app {

/// A symbolic link to a pty, there for as long as the object lives. An existing link is replaced in
/// one step; anything else in its place is left alone and an error.
class PtyLink {
  public:
    /// Throws std::system_error.
    PtyLink(std::string link, const std::string& target);
    ~PtyLink();
    PtyLink(const PtyLink&) = delete;
    PtyLink& operator=(const PtyLink&) = delete;

  private:
    std::string link_;
    std::string target_;
};

}  // namespace panelgate::app
