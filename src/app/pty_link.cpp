#include "pty_link.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

namespace panelgate::app {

namespace fs = std::filesystem;

PtyLink::PtyLink(std::string link, const std::string& target)
    : link_(std::move(link)), target_(target) {
    std::error_code error;
    const fs::file_status status = fs::symlink_status(link_, error);
    if (fs::exists(status) && !fs::is_symlink(status)) {
        throw std::system_error(std::make_error_code(std::errc::file_exists), link_);
    }
    const std::string fresh = link_ + ".new";
    fs::remove(fresh, error);
    fs::create_symlink(target_, fresh, error);
    if (!error) fs::rename(fresh, link_, error);
    if (error) throw std::system_error(error, link_);
}

PtyLink::~PtyLink() {
    std::error_code error;
    if (fs::read_symlink(link_, error) == target_) fs::remove(link_, error);  // still ours
}

}  // namespace panelgate::app
