#include "panelgate/gateway/text_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace panelgate::gateway {

namespace fs = std::filesystem;

namespace {

/// A file in a container is often a mount of its own, which no other file can replace.
bool is_mount(const std::string& file, const std::string& folder) {
    struct statx of_file{};
    struct statx of_folder{};
    return ::statx(AT_FDCWD, file.c_str(), 0, STATX_MNT_ID, &of_file) == 0 &&
           ::statx(AT_FDCWD, folder.c_str(), 0, STATX_MNT_ID, &of_folder) == 0 &&
           of_file.stx_mnt_id != of_folder.stx_mnt_id;
}

/// True where commits decide what is in the file. etckeeper commits what it finds.
bool is_of_git(fs::path folder) {
    std::error_code unknown;
    for (; !fs::exists(folder / ".git", unknown); folder = folder.parent_path())
        if (folder == folder.parent_path()) return false;
    return !fs::exists(folder / ".etckeeper", unknown);
}

bool write_all(int file, std::string_view text) {
    while (!text.empty()) {
        const ssize_t n = ::write(file, text.data(), text.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
}

/// Writes a new file with the owner, the group and the rights of the old one, as far as this
/// program may give them; false, with errno, if the disk has not taken it.
bool write_like(const std::string& old, const std::string& path, std::string_view text) {
    struct stat as{};
    if (::stat(old.c_str(), &as) != 0) return false;
    ::unlink(path.c_str());
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                            S_IRUSR | S_IWUSR);
    if (file < 0) return false;
    // What one group may read, another group may not.
    const bool same_group = ::fchown(file, as.st_uid, as.st_gid) == 0 ||
                            ::fchown(file, static_cast<uid_t>(-1), as.st_gid) == 0;
    const mode_t mode = as.st_mode & (same_group ? 0777U : 0707U);
    const bool done = ::fchmod(file, mode) == 0 && write_all(file, text) && ::fsync(file) == 0;
    const int why = errno;
    ::close(file);
    errno = why;
    return done;
}

}  // namespace

std::string why_read_only(const std::string& file) {
    std::error_code gone;
    const fs::path real = fs::canonical(file, gone);
    if (gone) return file + " cannot be found";
    if (!fs::is_regular_file(real, gone)) return file + " is no regular file";
    const std::string folder = real.parent_path();
    if (is_mount(real, folder))
        return real.string() +
               " is a mount of its own, which no other file can replace; mount its "
               "folder instead";
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        return errno == EROFS ? folder + " is mounted read-only"
                              : "this program may not write in " + folder;
    if (is_of_git(folder)) return real.string() + " is under Git; commit the change there";
    return {};
}

std::string replace_file(const std::string& file, std::string_view text) {
    std::error_code gone;
    const fs::path real = fs::canonical(file, gone);
    const std::string fresh = real.string() + ".new";
    errno = ENOENT;
    const bool done =
        !gone && write_like(real, fresh, text) && std::rename(fresh.c_str(), real.c_str()) == 0;
    if (!done) {
        const std::string why = std::strerror(errno);
        ::unlink(fresh.c_str());
        return file + " cannot be written: " + why;
    }
    const int folder = ::open(real.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder >= 0) {
        ::fsync(folder);
        ::close(folder);
    }
    return {};
}

}  // namespace panelgate::gateway
