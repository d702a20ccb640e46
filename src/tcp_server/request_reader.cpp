#include "request_reader.hpp"

#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

namespace panelgate::tcp_server {

/// Modbus/TCP: unrecoverable framing errors close the connection (MBAP-05 to MBAP-07).
class MbapReader : public RequestReader {
  public:
    explicit MbapReader(const Settings& settings);

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<ReaderEvent> next(TimePoint now) override;
    bool partial() const override { return framer_.partial(); }
    std::optional<TimePoint> due() const override;
    void on_due(TimePoint now) override;
    void pause() override { begun_.reset(); }

  private:
    ReaderEvent on_other_protocol();

    Duration partial_timeout_;
    int bad_protocol_ids_allowed_;
    FirstBytes first_{modbus::Framing::tcp};
    modbus::MbapFramer framer_;
    int bad_protocol_ids_ = 0;        ///< consecutive
    std::optional<TimePoint> begun_;  ///< start of the incomplete ADU
    bool late_ = false;
};

/// Common to RTU and ASCII: invalid bytes are skipped, and only a client that sends nothing else is
/// closed.
class SerialReader : public RequestReader {
  protected:
    explicit SerialReader(const Settings& settings)
        : first_(settings.framing), garbage_limit_(settings.garbage_limit) {}
    void look_at(ByteView bytes) { first_.feed(bytes); }
    /// True if events are pending, so the framer need not be asked.
    bool has_pending_event() const { return unreported_faults_ > 0 || pending_adu_; }
    /// Returns the next event. `discarded`: bytes since the last good frame; `faults`: new ones.
    std::optional<ReaderEvent> tell(std::optional<modbus::SerialAdu> adu, std::size_t discarded,
                                    std::size_t faults);

  private:
    FirstBytes first_;
    std::size_t garbage_limit_;
    std::size_t unreported_faults_ = 0;             ///< faults not reported yet
    std::optional<modbus::SerialAdu> pending_adu_;  ///< frame behind those faults
};

/// RTU frames in a stream. A silence ends frames of unknown length and discards a false start in
/// front of a good frame; an incomplete request is dropped after partial_adu_timeout.
class RtuReader : public SerialReader {
  public:
    explicit RtuReader(const Settings& settings);

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<ReaderEvent> next(TimePoint now) override;
    bool partial() const override { return framer_.partial(); }
    std::optional<TimePoint> due() const override;
    void on_due(TimePoint now) override;
    void on_end() override { framer_.on_silence(); }
    void pause() override {
        begun_.reset();
        unread_ = true;
    }

  private:
    Duration silence_;
    Duration partial_timeout_;
    modbus::RtuRequestFramer framer_;
    TimePoint heard_{};        ///< time of the last byte
    bool was_silent_ = false;  ///< silence since then, already handled
    bool unread_ = false;      ///< not read for a while: silences were not observed
    std::optional<TimePoint> begun_;
};

/// ASCII frames in a stream. The character timeout is checked only when more bytes arrive.
class AsciiReader : public SerialReader {
  public:
    explicit AsciiReader(const Settings& settings);

    void feed(TimePoint now, ByteView bytes) override;
    std::optional<ReaderEvent> next(TimePoint now) override;
    bool partial() const override { return framer_.partial(); }
    std::optional<TimePoint> due() const override { return std::nullopt; }
    void on_due(TimePoint) override {}
    void pause() override {}

  private:
    modbus::AsciiFramer framer_;
};

std::unique_ptr<RequestReader> make_request_reader(const Settings& settings) {
    switch (settings.framing) {
        case modbus::Framing::tcp:
            return std::make_unique<MbapReader>(settings);
        case modbus::Framing::rtu:
            return std::make_unique<RtuReader>(settings);
        case modbus::Framing::ascii:
            return std::make_unique<AsciiReader>(settings);
    }
    std::abort();
}

namespace {

constexpr std::size_t kKept = modbus::kMaxAsciiAdu;

std::string word(modbus::Framing framing) { return std::string(modbus::label(framing)); }

/// True for an HTTP request line (RFC 9112, 3) of any method.
bool is_http_request_line(ByteView first) {
    const std::string text(first.begin(), first.end());
    const std::string line = text.substr(0, text.find('\r'));
    const std::size_t method = line.find(' ');
    const std::size_t version = line.rfind(" HTTP/1.");
    return method != line.npos && version != line.npos && method > 0 && method < version &&
           line.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") == method;
}

/// A handshake record that is a client's hello (RFC 8446 5.1, 4). As MBAP its protocol id is not 0;
/// a read of unit 22 begins alike, but has no two lengths that fit each other.
bool is_tls_hello(ByteView first) {
    if (first.size() < 9 || first[0] != 0x16 || first[1] != 3 || first[2] > 4 || first[5] != 1)
        return false;
    const std::size_t record = first[3] * 256U + first[4];
    const std::size_t hello = (first[6] * 256U + first[7]) * 256U + first[8];
    return record == hello + 4;
}

std::optional<std::string> foreign(modbus::Framing expected, ByteView first) {
    if (const auto spoken = modbus::other_framing(expected, first))
        return std::string(name_of(*spoken)) +
               " and needs a listener with framing: " + word(*spoken);
    if (is_tls_hello(first)) return "TLS and needs a listener with tls";
    if (is_http_request_line(first)) return "HTTP and needs the listener of 'http'";
    return std::nullopt;
}

}  // namespace

std::string_view name_of(modbus::Framing framing) {
    switch (framing) {
        case modbus::Framing::tcp:
            return "Modbus/TCP";
        case modbus::Framing::rtu:
            return "Modbus RTU";
        case modbus::Framing::ascii:
            return "Modbus ASCII";
    }
    std::abort();
}

void FirstBytes::feed(ByteView bytes) {
    if (!watching_) return;
    append_up_to(kKept, bytes_, bytes);
    objection_ = foreign(expected_, bytes_);
    if (objection_ || bytes_.size() == kKept) on_request();
}

void FirstBytes::on_request() {
    watching_ = false;
    bytes_ = Bytes();
}

std::optional<Unusable> FirstBytes::take_objection() {
    const auto objection = std::exchange(objection_, std::nullopt);
    if (!objection) return std::nullopt;
    return Unusable{"it speaks " + *objection + "; this one has framing: " + word(expected_),
                    rt::LogLevel::warn};
}

MbapReader::MbapReader(const Settings& settings)
    : partial_timeout_(settings.partial_adu_timeout),
      bad_protocol_ids_allowed_(settings.bad_protocol_ids) {}

void MbapReader::feed(TimePoint, ByteView bytes) {
    first_.feed(bytes);
    framer_.feed(bytes);
}

std::optional<ReaderEvent> MbapReader::next(TimePoint now) {
    if (auto objection = first_.take_objection()) return std::move(*objection);
    if (std::exchange(late_, false)) return Unusable{"half-sent ADU"};
    auto event = framer_.next();
    if (!event) {
        if (framer_.partial() && !begun_) begun_ = now;
        return std::nullopt;
    }
    begun_.reset();
    if (std::holds_alternative<modbus::Broken>(*event)) return Unusable{"length outside 2..254"};
    if (std::holds_alternative<modbus::SkippedProtocol>(*event)) return on_other_protocol();
    bad_protocol_ids_ = 0;
    first_.on_request();
    return std::get<modbus::Adu>(std::move(*event));
}

/// MBAP-06.
ReaderEvent MbapReader::on_other_protocol() {
    if (++bad_protocol_ids_ >= bad_protocol_ids_allowed_) return Unusable{"protocol id is not 0"};
    return Discarded{};
}

/// An ADU must be complete within partial_timeout_ (MBAP-07), counted from its start, or from when
/// reading resumes after a time without room.
std::optional<TimePoint> MbapReader::due() const {
    if (!begun_) return std::nullopt;
    return *begun_ + partial_timeout_;
}

void MbapReader::on_due(TimePoint now) {
    if (begun_ && now >= *begun_ + partial_timeout_) late_ = true;
}

std::optional<ReaderEvent> SerialReader::tell(std::optional<modbus::SerialAdu> adu,
                                              std::size_t discarded, std::size_t faults) {
    if (auto objection = first_.take_objection()) return std::move(*objection);
    unreported_faults_ += faults;
    if (adu) pending_adu_ = std::move(adu);
    if (unreported_faults_ > 0) {
        --unreported_faults_;
        return Discarded{};
    }
    if (pending_adu_) {
        first_.on_request();
        modbus::SerialAdu given = *std::exchange(pending_adu_, std::nullopt);
        return modbus::Adu{0, given.station, std::move(given.pdu)};
    }
    if (discarded <= garbage_limit_) return std::nullopt;
    return Unusable{"no request in " + std::to_string(discarded) + " bytes"};
}

RtuReader::RtuReader(const Settings& settings)
    : SerialReader(settings),
      silence_(settings.rtu_silence),
      partial_timeout_(settings.partial_adu_timeout) {}

void RtuReader::feed(TimePoint now, ByteView bytes) {
    const bool unread = std::exchange(unread_, false);
    const Duration silent = now - heard_;
    if (silent >= silence_ && !was_silent_ && !unread) framer_.on_silence();
    // The rest of a damaged request, of which a part was taken, will not come either.
    if (silent >= partial_timeout_ && !unread) framer_.drop_pending();
    heard_ = now;
    was_silent_ = false;
    look_at(bytes);
    framer_.feed(bytes);
}

std::optional<ReaderEvent> RtuReader::next(TimePoint now) {
    std::optional<modbus::SerialAdu> adu;
    if (!has_pending_event()) adu = framer_.next();
    if (adu) begun_.reset();
    auto event = tell(std::move(adu), framer_.discarded(), framer_.take_faults());
    if (!event && framer_.partial() && !begun_) begun_ = now;
    return event;
}

std::optional<TimePoint> RtuReader::due() const {
    if (!framer_.partial()) return std::nullopt;
    if (!was_silent_) return heard_ + silence_;
    if (!begun_) return std::nullopt;
    return *begun_ + partial_timeout_;
}

void RtuReader::on_due(TimePoint now) {
    if (now - heard_ >= silence_ && !std::exchange(was_silent_, true)) framer_.on_silence();
    if (!begun_ || now - *begun_ < partial_timeout_) return;
    framer_.drop_pending();
    begun_.reset();
}

AsciiReader::AsciiReader(const Settings& settings)
    : SerialReader(settings), framer_(settings.ascii_digits, settings.ascii_pause) {}

void AsciiReader::feed(TimePoint now, ByteView bytes) {
    look_at(bytes);
    framer_.feed(now, bytes);
}

std::optional<ReaderEvent> AsciiReader::next(TimePoint) {
    std::optional<modbus::SerialAdu> adu;
    if (!has_pending_event()) adu = framer_.next();
    return tell(std::move(adu), framer_.discarded(), framer_.take_faults());
}

}  // namespace panelgate::tcp_server
