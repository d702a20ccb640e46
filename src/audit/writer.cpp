#include "writer.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "panelgate/audit/files.hpp"
#include "panelgate/base/bytes.hpp"

namespace panelgate::audit {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kTail = 256 * 1024;   // of a file, to find its last record
constexpr std::size_t kChunk = 128 * 1024;  // written at once
constexpr std::size_t kTornShown = 512;

/// Reads `count` bytes at `from`; fewer at the end of the file.
std::string read_at(int file, off_t from, std::size_t count) {
    std::string text(count, '\0');
    std::size_t got = 0;
    while (got < count) {
        const ssize_t more =
            ::pread(file, text.data() + got, count - got, from + static_cast<off_t>(got));
        if (more < 0 && errno == EINTR) continue;
        if (more <= 0) break;
        got += static_cast<std::size_t>(more);
    }
    text.resize(got);
    return text;
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

/// Tells chains apart in a log; a second audit must not have the same one by chance.
std::string new_id() {
    std::array<std::uint8_t, 8> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) return {};
    return to_hex(bytes, "");
}

/// A new name is on the disk only when its folder is.
void sync_folder(const std::string& file) {
    const fs::path folder = fs::path(file).parent_path();
    const int handle =
        ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (handle < 0) return;
    ::fsync(handle);
    ::close(handle);
}

}  // namespace

Writer::Writer(Settings settings, Wall wall, std::string start, Also also)
    : settings_(std::move(settings)),
      wall_(std::move(wall)),
      start_(std::move(start)),
      also_(std::move(also)) {}

Writer::~Writer() { close(); }

void Writer::close() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
}

void Writer::apply(const Settings& settings) {
    const bool other = settings.file != settings_.file;
    settings_ = settings;
    if (!other) return;
    close();
    take_back();
    chain_ = Chain();
    safe_ = {};
    id_.clear();
    from_ = 1;
    gone_ = 0;
    known_ = begun_ = unclean_ = unsynced_ = false;
    sealed_ = 0;
    torn_bytes_ = 0;
}

/// What another file did not take any more belongs to the next one's chain.
void Writer::take_back() {
    std::string bodies;
    const std::size_t line = sent_ == 0 ? 0 : out_.rfind('\n', sent_ - 1) + 1;  // npos + 1 is 0
    for (std::size_t at = line; at < out_.size();) {
        const std::size_t end = std::min(out_.find('\n', at), out_.size());
        const auto record = parse_line(std::string_view(out_).substr(at, end - at));
        if (record && sent_ < out_.size()) bodies.append(record->body) += '\n';
        at = end + 1;
    }
    bodies.append(batch_, std::min(at_, batch_.size()));
    batch_ = std::move(bodies);
    out_.clear();
    at_ = sent_ = 0;
}

void Writer::take(std::string& bodies) {
    batch_.clear();
    std::swap(batch_, bodies);
    at_ = 0;
}

bool Writer::fail(const std::string& what) {
    why_ = what + ": " + std::strerror(errno);
    return false;
}

/// Whole lines that a full disk took before it was full are there, if they can be synchronized.
std::uint64_t Writer::unwritten() {
    const auto lines = [](const std::string& text, std::size_t from) {
        const auto begin = text.begin() + static_cast<std::ptrdiff_t>(std::min(from, text.size()));
        return static_cast<std::uint64_t>(std::count(begin, text.end(), '\n'));
    };
    const bool is_there = file_ >= 0 && sealed_ > 0 && ::fdatasync(file_) == 0;
    return (is_there ? lines(out_, sent_) : sealed_) + lines(batch_, at_);
}

/// Closes a file that has no longer its name: it was moved away by a rotation that is not ours, or
/// removed, which is a failure, as it is if others have written to it or cut it off. False: just
/// now.
bool Writer::look_after_file() {
    struct stat named{};
    struct stat open{};
    const bool there = ::stat(settings_.file.c_str(), &named) == 0;
    if (!there && errno != ENOENT) return true;
    if (::fstat(file_, &open) != 0) return true;
    const bool is_ours = there && named.st_ino == open.st_ino && named.st_dev == open.st_dev;
    if (is_ours && static_cast<std::size_t>(open.st_size) == size_) return true;
    close();
    if (is_ours) {
        gone_ = first_;
        why_ = settings_.file +
               " was changed by another program while it was written, with the "
               "records " +
               std::to_string(first_) + " to " + std::to_string(safe_.number);
        return false;
    }
    if (open.st_nlink > 0) {
        remark_ = settings_.file + " was moved away, and a new one begins";
        return true;
    }
    gone_ = first_;
    why_ = settings_.file + " was removed while it was written, with the records " +
           std::to_string(first_) + " to " + std::to_string(safe_.number);
    return false;
}

bool Writer::ensure_open() {
    if (file_ >= 0 && !look_after_file()) return false;
    if (file_ >= 0) return true;
    if (!open() || !resume()) {
        close();
        return false;
    }
    if (!begun_) begin_run();
    return true;
}

bool Writer::open() {
    constexpr mode_t kMode = S_IRUSR | S_IWUSR | S_IRGRP;
    const char* name = settings_.file.c_str();
    file_ = ::open(name, O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, kMode);
    if (file_ < 0) return fail("cannot open " + settings_.file);
    struct stat found{};
    if (::fstat(file_, &found) != 0) return fail("cannot open " + settings_.file);
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

/// What the first record of a file says of its chain.
void Writer::read_head(std::string_view head) {
    const auto record = parse_line(head.substr(0, head.find('\n')));
    first_ = record ? record->number : chain_.last().number;
    if (!record || member_of(record->body, "kind") != "file") return;
    id_ = member_of(record->body, "chain");
    const std::string from(member_of(record->body, "from"));
    from_ = std::strtoull(from.c_str(), nullptr, 10);
}

/// Goes on where the newest full file ends.
void Writer::resume_after_older() {
    const auto older = rotated_files(settings_.file);
    const int file = older.empty() ? -1 : ::open(older.back().c_str(), O_RDONLY | O_CLOEXEC);
    struct stat found{};
    if (file >= 0 && ::fstat(file, &found) == 0) {
        const auto size = static_cast<std::size_t>(found.st_size);
        const std::size_t count = std::min(size, kTail);
        const std::string end = read_at(file, static_cast<off_t>(size - count), count);
        const Tail tail = parse_tail(end);
        chain_ = Chain(tail.last);
        unclean_ = tail.last.number > 0 && !tail.ended;
        if (tail.last.number > 0) read_head(read_at(file, 0, kTail));
    }
    if (file >= 0) ::close(file);
    known_ = true;
}

/// Finds out where the chain stands, and goes on there.
bool Writer::resume() {
    if (size_ > 0) {
        const std::size_t count = std::min(size_, kTail);
        const std::string end = read_at(file_, static_cast<off_t>(size_ - count), count);
        if (!resume_from(end, count == size_)) return false;
    }
    if (size_ > 0) {
        read_head(read_at(file_, 0, kTail));
        return true;
    }
    if (!known_) resume_after_older();
    begin_file();
    return true;
}

/// Takes the end of the file that is there. A torn line is cut off, and told in the record `start`.
bool Writer::resume_from(std::string_view end, bool is_whole) {
    const Tail tail = parse_tail(end);
    const bool has_record = tail.last.number > 0;
    const bool is_torn_only = tail.continuable && !has_record && is_whole;
    if (!has_record && !is_torn_only) return set_aside("its last line is no record");
    if (known_ && tail.last != chain_.last())
        return set_aside("it is not the one that was written");
    if (!tail.torn.empty()) {
        torn_bytes_ = tail.torn.size();
        torn_ = tail.torn.substr(0, kTornShown);
        size_ -= tail.torn.size();
        if (::ftruncate(file_, static_cast<off_t>(size_)) != 0) return fail("cannot mend the end");
    }
    if (!has_record) return true;
    unclean_ = !tail.ended;
    chain_ = Chain(tail.last);
    safe_ = tail.last;
    known_ = true;
    return true;
}

bool Writer::set_aside(const char* why) {
    const std::string name = rename_aside(settings_.file, settings_.file + ".aside");
    if (name.empty()) return fail("cannot rename " + settings_.file);
    remark_ = settings_.file + " is kept as " + name + ", and a new one begins: " + why;
    close();
    return open() && size_ == 0;
}

void Writer::begin_file() {
    if (chain_.last().number == 0) {
        id_ = new_id();
        from_ = 1;
    }
    composer_.begin(wall_(), Kind::file).text("previous", text_of(chain_.last().hash));
    composer_.text("chain", id_);
    if (from_ > 0) composer_.number("from", from_);
    if (const std::uint64_t gone = std::exchange(gone_, 0); gone > 0)
        composer_.number("gone", gone);
    first_ = chain_.last().number + 1;
    if (sent_ == out_.size()) append(composer_.body());
}

void Writer::begin_run() {
    begun_ = true;
    composer_.begin(wall_(), Kind::start);
    if (unclean_) composer_.flag("unclean", true);
    if (torn_bytes_ > 0) composer_.number("torn_bytes", torn_bytes_).text("torn", torn_);
    composer_.text("remark", remark_);
    append(std::string(composer_.body()) + start_);
    if (unclean_ && remark_.empty())
        remark_ = "the run before did not end in order: what it recorded last may be missing";
}

void Writer::append(std::string_view body) {
    const std::size_t from = out_.size();
    chain_.append(out_, body);
    ++sealed_;
    if (also_) also_(std::string_view(out_).substr(from, out_.size() - from - 1));
}

void Writer::seal() {
    while (at_ < batch_.size() && out_.size() < kChunk && size_ + out_.size() < settings_.rotate) {
        const std::size_t end = std::min(batch_.find('\n', at_), batch_.size());
        append(std::string_view(batch_).substr(at_, end - at_));
        at_ = std::min(end + 1, batch_.size());
    }
}

bool Writer::flush() {
    while (sent_ < out_.size()) {
        const ssize_t done = ::write(file_, out_.data() + sent_, out_.size() - sent_);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0) return fail("cannot write " + settings_.file);
        sent_ += static_cast<std::size_t>(done);
        size_ += static_cast<std::size_t>(done);
        unsynced_ = true;
    }
    out_.clear();
    sent_ = 0;
    return true;
}

bool Writer::sync() {
    if (unsynced_ && ::fdatasync(file_) != 0) return fail("cannot synchronize " + settings_.file);
    unsynced_ = false;
    records_ += std::exchange(sealed_, 0);
    safe_ = chain_.last();
    return true;
}

bool Writer::work() {
    if (!ensure_open()) return false;
    do {
        if (!flush()) return false;
        if (size_ >= settings_.rotate && at_ < batch_.size() && !rotate()) return false;
        seal();
    } while (sent_ < out_.size() || at_ < batch_.size());
    return sync();
}

bool Writer::rotate() {
    if (!sync()) return false;
    if (rename_aside(settings_.file, rotated_name(settings_.file, first_)).empty())
        return fail("cannot rename " + settings_.file);
    close();
    ++rotations_;
    const std::vector<std::string> oldest = find_oldest();
    if (!open() || !resume()) {
        close();
        return false;
    }
    // The new file says which ones are kept before the others go: a crash between leaves too many.
    errno = 0;
    const bool begun = flush() && sync();
    if (begun || errno == ENOSPC)
        for (const std::string& name : oldest) std::remove(name.c_str());
    sync_folder(settings_.file);
    return begun;
}

/// The files that are too many; what is kept begins behind them.
std::vector<std::string> Writer::find_oldest() {
    std::vector<std::string> oldest = rotated_files(settings_.file);
    if (oldest.size() <= settings_.keep) return {};
    const std::size_t count = oldest.size() - settings_.keep;
    from_ = chain_.last().number + 1;
    if (settings_.keep > 0) from_ = number_in(oldest[count], settings_.file).value_or(from_);
    oldest.resize(count);
    return oldest;
}

}  // namespace panelgate::audit
