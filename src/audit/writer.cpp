#include "panelgate/audit/writer.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "panelgate/audit/files.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/text.hpp"

namespace panelgate::audit {

namespace fs = std::filesystem;

namespace {

constexpr std::streamoff kTail = 256 * 1024;  // of a file, to find its last record
constexpr std::size_t kTornShown = 512;

/// Returns the end of a file, at most kTail bytes; "" if there is none.
std::string end_of(const std::string& file) {
    std::ifstream in(file, std::ios::binary | std::ios::ate);
    const std::streamoff size = in.tellg();
    if (!in || size <= 0) return {};
    std::string end(static_cast<std::size_t>(std::min(size, kTail)), '\0');
    in.seekg(-std::min(size, kTail), std::ios::end);
    in.read(end.data(), static_cast<std::streamsize>(end.size()));
    return end;
}

bool write_all(int file, std::string_view text) {
    while (!text.empty()) {
        const ssize_t done = ::write(file, text.data(), text.size());
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return false;
        text.remove_prefix(static_cast<std::size_t>(done));
    }
    return true;
}

/// Renames without ever replacing another file: "NAME", or "NAME-2", ... Returns the name; "" if
/// it failed.
std::string rename_aside(const std::string& from, const std::string& to) {
    constexpr int kTries = 1000;
    for (int i = 1; i <= kTries; ++i) {
        const std::string name = i == 1 ? to : to + '-' + std::to_string(i);
        if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, name.c_str(), RENAME_NOREPLACE) == 0)
            return name;
        if (errno != EEXIST) return {};
    }
    return {};
}

/// Tells chains apart in a log; a second audit must not have the same id by chance.
std::string new_id() {
    std::array<std::uint8_t, 8> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return {};
    return to_hex(bytes, "");
}

/// A new name is on the disk only when its folder is.
void sync_folder(const std::string& file) {
    const fs::path folder = fs::path(file).parent_path();
    const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (handle < 0) return;
    ::fsync(handle);
    ::close(handle);
}

}  // namespace

Writer::Writer(Settings settings, Wall wall, Members start)
    : settings_(std::move(settings)), wall_(std::move(wall)), start_(std::move(start)) {}

void Writer::close() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
    first_ = 0;
}

bool Writer::fail(const std::string& what) {
    why_ = what + ": " + std::strerror(errno);
    return false;
}

bool Writer::ensure_open() {
    if (file_ >= 0) look_after_file();
    if (file_ >= 0) return true;
    if (open() && resume()) return true;
    close();
    return false;
}

/// Closes a file that was removed or moved away, or that others have written to or cut off: the
/// next one says which records have gone.
void Writer::look_after_file() {
    struct stat named{};
    struct stat opened{};
    const bool there = ::stat(settings_.file.c_str(), &named) == 0;
    if (::fstat(file_, &opened) != 0) return;
    const bool is_ours = there && named.st_ino == opened.st_ino && named.st_dev == opened.st_dev;
    if (is_ours && static_cast<std::size_t>(opened.st_size) == size_) return;
    gone_ = first_;
    close();
    remark_ = settings_.file +
              (is_ours ? " was changed by another program" : " was removed or moved away") +
              " while it was written, with the records " + std::to_string(gone_) + " to " +
              std::to_string(last().number) + ", and a new one begins";
}

bool Writer::open() {
    constexpr mode_t kMode = S_IRUSR | S_IWUSR | S_IRGRP;
    const char* name = settings_.file.c_str();
    file_ = ::open(name, O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, kMode);
    struct stat found{};
    if (file_ < 0 || ::fstat(file_, &found) != 0) return fail("cannot open " + settings_.file);
    if (!S_ISREG(found.st_mode)) {
        why_ = settings_.file + " is no regular file";
        return false;
    }
    if (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
        why_ = "another process writes to " + settings_.file;
        return false;
    }
    size_ = static_cast<std::size_t>(found.st_size);
    return true;
}

/// Finds out where the chain stands, and goes on there.
bool Writer::resume() {
    if (!known_ && !find_position()) return false;
    if (size_ > 0 && first_ == 0 && !set_aside("it is not the one that was written")) return false;
    compose_head();
    return true;
}

/// Looks for the last record in the file that is there, or in the newest full one. A torn line is
/// cut off, and told in the record `start`; a file that is all another text is set aside.
bool Writer::find_position() {
    const auto older = rotated_files(settings_.file);
    const std::string& newest = size_ == 0 && !older.empty() ? older.back() : settings_.file;
    const std::string end = end_of(newest);
    const Tail tail = parse_tail(end);
    const bool is_torn_only = tail.torn.size() == size_ && is_beginning(tail.torn);
    if (size_ > 0 && tail.last.number == 0 && !is_torn_only)
        return set_aside("its last line is no record") && find_position();
    if (size_ > 0 && !tail.torn.empty()) {
        torn_ = tail.torn;
        size_ -= torn_.size();
        if (::ftruncate(file_, static_cast<off_t>(size_)) != 0) return fail("cannot mend the end");
        if (size_ == 0) return find_position();
    }
    chain_ = Chain(tail.last);
    unclean_ = tail.last.number > 0 && !tail.ended;
    known_ = true;
    read_lines(newest, [this](std::string_view line, bool) {
        const auto record = parse_line(line);
        if (size_ > 0) first_ = record ? record->number : last().number;
        if (!record || member_of(record->body, "kind") != "file") return false;
        id_ = member_of(record->body, "chain");
        from_ = to_number<std::uint64_t>(member_of(record->body, "from")).value_or(0);
        return false;
    });
    return true;
}

bool Writer::set_aside(const char* why) {
    const std::string name = rename_aside(settings_.file, settings_.file + ".aside");
    if (name.empty()) return fail("cannot rename " + settings_.file);
    remark_ += (remark_.empty() ? "" : "; ") + settings_.file + " is kept as " + name +
               ", and a new one begins: " + why;
    close();
    return open() && size_ == 0;
}

/// An empty file begins with a record `file`, a run with a record `start`.
void Writer::compose_head() {
    head_.clear();
    if (size_ == 0) {
        if (last().number == 0) {
            id_ = new_id();
            from_ = 1;
        }
        Members file = record_of("file", wall_());
        add_text(file, "previous", last().hash);
        add_text(file, "chain", id_);
        if (from_ > 0) file["from"] = from_;
        if (gone_ > 0) file["gone"] = gone_;
        first_ = last().number + 1;
        head_ = body_of(file) + '\n';
    }
    if (begun_) return;
    Members start = record_of("start", wall_());
    if (unclean_) start["unclean"] = true;
    if (!torn_.empty()) start["torn_bytes"] = torn_.size();
    add_text(start, "torn", std::string_view(torn_).substr(0, kTornShown));
    add_text(start, "remark", remark_);
    add(start, start_);
    head_ += body_of(start) + '\n';
    if (unclean_ && remark_.empty())
        remark_ = "the run before did not end in order: what it recorded last may be missing";
}

bool Writer::write(std::string& bodies) {
    if (!ensure_open()) return false;
    if (!head_.empty()) {
        if (!append(head_)) return false;
        begun_ = true;
        gone_ = 0;
    }
    if (bodies.empty()) return true;
    if (size_ >= settings_.rotate && !rotate()) return false;
    return append(bodies);
}

/// Makes records of bodies, writes and synchronizes them, and clears `bodies`; or leaves bodies and
/// file as they were.
bool Writer::append(std::string& bodies) {
    const Position before = last();
    std::string lines;
    for (std::size_t at = 0; at < bodies.size();) {
        const std::size_t end = bodies.find('\n', at);
        chain_.append(lines, std::string_view(bodies).substr(at, end - at));
        at = end + 1;
    }
    if (!write_all(file_, lines) || ::fdatasync(file_) != 0) {
        fail("cannot write " + settings_.file);
        if (::ftruncate(file_, static_cast<off_t>(size_)) != 0) close();
        chain_ = Chain(before);
        return false;
    }
    size_ += lines.size();
    records_ += last().number - before.number;
    bodies.clear();
    return true;
}

bool Writer::rotate() {
    if (rename_aside(settings_.file, rotated_name(settings_.file, first_)).empty())
        return fail("cannot rename " + settings_.file);
    close();
    ++rotations_;
    const std::vector<std::string> oldest = find_oldest();
    // The new file says which files are kept before the others go: a crash between leaves too many.
    if (!ensure_open() || !append(head_)) return false;
    for (const std::string& name : oldest) std::remove(name.c_str());
    sync_folder(settings_.file);
    return true;
}

/// Returns the files beyond Settings::keep, and moves `from_` to the oldest kept record.
std::vector<std::string> Writer::find_oldest() {
    std::vector<std::string> oldest = rotated_files(settings_.file);
    if (oldest.size() <= settings_.keep) return {};
    const std::size_t count = oldest.size() - settings_.keep;
    from_ = last().number + 1;
    if (settings_.keep > 0) from_ = first_record(oldest[count]);
    oldest.resize(count);
    return oldest;
}

}  // namespace panelgate::audit
