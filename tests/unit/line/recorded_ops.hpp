#pragma once

#include <asm/ioctls.h>
#include <asm/termbits.h>  // not with <termios.h>
#include <linux/serial.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/line/port_ops.hpp"

namespace panelgate::line {

/// Replays the answers of a real driver: tests/kernel/recorded/NAME.txt, whose format is described
/// in tests/kernel/README.md. What was not recorded is -ENOSYS.
class RecordedOps final : public PortOps {
  public:
    explicit RecordedOps(const std::string& name) {
        std::ifstream in(std::string(SOURCE_ROOT) + "/tests/kernel/recorded/" + name + ".txt");
        std::string line;
        while (std::getline(in, line)) {
            if (!line.empty() && line[0] != '#') rows_.push_back(row_of(line));
        }
    }
    bool is_empty() const { return rows_.empty(); }

    int control(int, unsigned long request, void* argument) override {
        switch (request) {
            case TCGETS2:
                return report_settings(*static_cast<termios2*>(argument));
            case TCSETS2:
                return take_settings(*static_cast<termios2*>(argument));
            case TIOCGSERIAL:
                return report_driver(*static_cast<serial_struct*>(argument));
            case TIOCOUTQ:
                return tell(row("TIOCOUTQ"), "value", *static_cast<int*>(argument));
            case TIOCSERGETLSR:
                return tell(row("TIOCSERGETLSR"), "bits", *static_cast<unsigned*>(argument));
            default:
                return row(name_of(request)).result;
        }
    }

  private:
    struct Row {
        std::string request;
        std::string asked;
        int result = -ENOSYS;
        std::map<std::string, std::uint32_t> answer;
    };

    static int result_of(const std::string& text) {
        static const std::map<std::string, int> kErrors{
            {"-ENOTTY", -ENOTTY}, {"-EIO", -EIO}, {"-EINVAL", -EINVAL}};
        const auto error = kErrors.find(text);
        return error == kErrors.end() ? std::stoi(text) : error->second;
    }
    static Row row_of(const std::string& line) {
        std::istringstream in(line);
        Row row;
        std::string result;
        std::string answer;
        in >> row.request >> row.asked >> result >> answer;
        row.result = result_of(result);
        std::istringstream fields(answer);
        std::string field;
        while (std::getline(fields, field, ',')) {
            const std::size_t equals = field.find('=');
            if (equals == std::string::npos) continue;
            const auto value = std::stoull(field.substr(equals + 1), nullptr, 0);
            row.answer[field.substr(0, equals)] = static_cast<std::uint32_t>(value);
        }
        return row;
    }
    static std::string name_of(unsigned long request) {
        static const std::map<unsigned long, std::string> kNames{{TIOCSSERIAL, "TIOCSSERIAL"},
                                                                 {TIOCGRS485, "TIOCGRS485"},
                                                                 {TIOCSRS485, "TIOCSRS485"},
                                                                 {TIOCMBIS, "TIOCMBIS"},
                                                                 {TIOCMBIC, "TIOCMBIC"},
                                                                 {TIOCGICOUNT, "TIOCGICOUNT"},
                                                                 {TCFLSH, "TCFLSH"}};
        const auto name = kNames.find(request);
        return name == kNames.end() ? "" : name->second;
    }
    template <class Value>
    static int tell(const Row& row, const char* field, Value& value) {
        if (row.result >= 0) value = static_cast<Value>(row.answer.at(field));
        return row.result;
    }
    /// The first recorded row of a request; an empty `asked` matches any argument.
    const Row& row(const std::string& request, const std::string& asked = {}) const {
        static const Row kNone;
        for (const Row& row : rows_) {
            if (row.request == request && (asked.empty() || row.asked == asked)) return row;
        }
        return kNone;
    }

    int report_settings(termios2& t) const {
        const Row& initial = row("TCGETS2");
        const Row* told = &initial;
        for (std::size_t i = 0; i + 1 < rows_.size() && !set_.empty(); ++i) {
            if (rows_[i].request == "TCSETS2" && rows_[i].asked == set_) told = &rows_[i + 1];
        }
        if (told->result < 0) return told->result;
        t.c_cflag = told->answer.at("cflag");
        t.c_ospeed = told->answer.at("ospeed");
        t.c_ispeed = told->answer.at("ispeed");
        return told->result;
    }
    int take_settings(const termios2& t) {
        SerialFormat format;
        format.baud = static_cast<int>(t.c_ospeed);
        format.stop_bits = (t.c_cflag & CSTOPB) != 0 ? 2 : 1;
        format.parity = Parity::none;
        if ((t.c_cflag & PARENB) != 0)
            format.parity = (t.c_cflag & PARODD) != 0 ? Parity::odd : Parity::even;
        set_ = to_string(format);  // "19200 8E1", recorded as 19200-8E1
        set_[set_.find(' ')] = '-';
        return row("TCSETS2", set_).result;
    }
    int report_driver(serial_struct& info) const {
        const Row& told = row("TIOCGSERIAL");
        if (told.result < 0) return told.result;
        info.type = static_cast<int>(told.answer.at("type"));
        info.flags = static_cast<int>(told.answer.at("flags"));
        return told.result;
    }

    std::vector<Row> rows_;
    std::string set_;
};

}  // namespace panelgate::line
