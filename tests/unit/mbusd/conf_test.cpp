#include "panelgate/mbusd/conf.hpp"

#include <gmock/gmock.h>

#include <string>
#include <utility>

#include "panelgate/config/config.hpp"
#include "unit/config/memory_files.hpp"

namespace panelgate::mbusd::conf_test {
namespace {

using config::Config;
using config::Line;
using config::load_valid;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Rs485 = line::Rs485::Mode;

Imported imported_of(const std::string& text) {
    yaml::Problems problems("mbusd.conf");
    const auto imported = import_conf(text, problems);
    EXPECT_TRUE(imported) << problems.text();
    return imported.value_or(Imported{});
}

Config load(const Imported& imported) { return load_valid(imported.yaml); }
Rs485 rs485_of(const Imported& imported) { return load(imported).lines[0].device.rs485.mode; }

std::string faults(const std::string& text) {
    yaml::Problems problems("mbusd.conf");
    EXPECT_FALSE(import_conf(text, problems));
    return problems.text();
}

TEST(MbusdConf, AnEmptyFileHasTheDefaultsOfMbusd) {
    const Imported imported = imported_of("# nothing\n\n   # at all\n");
    const Config config = load(imported);
    EXPECT_EQ(config.lines[0].device.device, "/dev/ttyS0");
    EXPECT_EQ(to_string(config.lines[0].device.serial), "19200 8N1");
    EXPECT_EQ(config.modbus_tcp[0].name(), "0.0.0.0:502");
    EXPECT_EQ(config.modbus_tcp[0].broadcast, tcp_server::BroadcastMode::silent);
    EXPECT_EQ(config.modbus_tcp[0].max_connections, 32U);
    EXPECT_EQ(config.lines[0].arbiter.unlisted.retries, 3);
    EXPECT_EQ(config.lines[0].arbiter.queue.deadline, Duration(3s)) << "four tries of 500 ms";
    EXPECT_THAT(imported.notes, IsEmpty());
}

TEST(MbusdConf, TakesOverWhatHasACounterpart) {
    const Config config = load(imported_of(
        "device = /dev/serial/x 'y$\nspeed=38400\n mode\t=\t8E2 \r\ntrx_control = RTS_0\n"
        "address = ::1\nport = 8080\nmaxconn = 7\nretries = 0\nwait = 900\n"
        "replyonbroadcast = Yes\nloglevel = 0\n"));
    const Line& line = config.lines[0];
    EXPECT_EQ(line.device.device, "/dev/serial/x 'y$");
    EXPECT_EQ(to_string(line.device.serial), "38400 8E2");
    EXPECT_EQ(line.device.rs485.mode, Rs485::rts);
    EXPECT_FALSE(line.device.rs485.rts_high_on_send);
    EXPECT_EQ(config.modbus_tcp[0].name(), "[::1]:8080");
    EXPECT_EQ(config.modbus_tcp[0].max_connections, 7U);
    EXPECT_EQ(config.modbus_tcp[0].broadcast, tcp_server::BroadcastMode::reply);
    EXPECT_EQ(line.arbiter.unlisted.response_timeout, Duration(900ms));
    EXPECT_EQ(line.arbiter.unlisted.retries, 0);
    EXPECT_EQ(line.arbiter.queue.deadline, Duration(2s));
    EXPECT_EQ(config.log.level, rt::LogLevel::error);
    EXPECT_FALSE(config.http) << "its port is taken";
}

TEST(MbusdConf, SwitchesTheTransceiverAsTheDriverOrRtsDid) {
    EXPECT_EQ(rs485_of(imported_of("enable_rs485 = yes")), Rs485::kernel);
    const auto rts = load(imported_of("trx_control = rts")).lines[0].device.rs485;
    EXPECT_EQ(rts.mode, Rs485::rts);
    EXPECT_TRUE(rts.rts_high_on_send);
    EXPECT_EQ(rs485_of(imported_of("trx_control = addc")), Rs485::off);
}

TEST(MbusdConf, SaysWhatHasNoCounterpartInCommentsAndNotes) {
    const Imported imported = imported_of(
        "pause = 100\ntimeout = 60\nlogfile = /var/log/\xe9.log\ntrx_control = sysfs_1\n"
        "trx_sysfile = /sys/class/gpio/gpio5/value\nretries = 15\n");
    EXPECT_EQ(load(imported).lines[0].arbiter.unlisted.retries, 10);
    ASSERT_EQ(imported.notes.size(), 5U);
    EXPECT_THAT(imported.notes[0], testing::StartsWith("mbusd.conf:1: pause = 100: between two"));
    EXPECT_THAT(imported.notes[2], HasSubstr("/var/log/?.log: the log goes to standard error"));
    for (const std::string& note : imported.notes)
        EXPECT_THAT(imported.yaml, HasSubstr("\n# " + note.substr(note.find(": ") + 2) + '\n'));
}

TEST(MbusdConf, ADriverThatSwitchesWinsOverRts) {
    const std::string rts = "trx_control = rts_0\n";
    const std::string kernel = "enable_rs485 = yes\n";
    for (const std::string& text : {rts + kernel, kernel + rts})
        EXPECT_EQ(rs485_of(imported_of(text)), Rs485::kernel) << text;
    EXPECT_EQ(rs485_of(imported_of("enable_rs485 = no\n" + rts)), Rs485::rts);
}

TEST(MbusdConf, OfARepeatedSettingTheLastCounts) {
    const Imported imported =
        imported_of("speed = 9600\ntrx_control = rts\nspeed = 38400\ntrx_control = addc\n");
    const Line line = load(imported).lines[0];
    EXPECT_EQ(line.device.serial.baud, 38400);
    EXPECT_EQ(line.device.rs485.mode, Rs485::off);
}

TEST(MbusdConf, AdvisesNothingWhereNothingIsLost) {
    EXPECT_THAT(imported_of("pause = 0\ntimeout = 0\n").notes, IsEmpty());
    EXPECT_THAT(imported_of("pause = 0x14\n").notes, ElementsAre(HasSubstr("{frame_gap: 20ms}")));
}

TEST(MbusdConf, ReadsNumbersAsMbusdDoes) {
    const Imported imported = imported_of("speed = 9600 # fast\nport = 0x1F6\nwait=+0764\n");
    const Config config = load(imported);
    EXPECT_EQ(config.lines[0].device.serial.baud, 9600);
    EXPECT_EQ(config.modbus_tcp[0].port, 502);
    EXPECT_EQ(config.lines[0].arbiter.unlisted.response_timeout, Duration(500ms));
    for (const char* value : {"fast", "-1", "0x", "99999999999999999999", "4294967298", "#9"})
        EXPECT_THAT(faults("port = " + std::string(value)), HasSubstr("1:8: port must be"));
}

TEST(MbusdConf, TakesFilesOfWindows) {
    for (const std::string end : {"\n", "\r\n"}) {
        const Imported imported =
            imported_of("\xef\xbb\xbf# one" + end + end + "speed = 9600" + end + "port = 503");
        EXPECT_EQ(load(imported).lines[0].device.serial.baud, 9600);
        EXPECT_EQ(load(imported).modbus_tcp[0].port, 503);
        EXPECT_THAT(faults("\xef\xbb\xbf#" + end + end + "adress = 1"),
                    HasSubstr("mbusd.conf:3:1: mbusd has no setting"));
    }
}

TEST(MbusdConf, TakesTheCommandLineOfAUnitOrAShell) {
    for (const std::string start :
         {"sudo /usr/bin/mbusd ", "[Service]\nExecStart=/usr/bin/mbusd ", "mbusd "}) {
        const Imported imported = imported_of(
            start + "-d -v2 -L - -p ttyUSB0 -s 9600 \\\n -m '8e1' -P 503 -W 300 -N0 -R 50 -b -t\n");
        const Config config = load(imported);
        EXPECT_EQ(config.lines[0].device.device, "/dev/ttyUSB0");
        EXPECT_EQ(to_string(config.lines[0].device.serial), "9600 8E1");
        EXPECT_EQ(config.lines[0].arbiter.unlisted.response_timeout, Duration(300ms));
        EXPECT_EQ(config.lines[0].arbiter.unlisted.retries, 0);
        EXPECT_EQ(config.lines[0].device.rs485.mode, Rs485::rts);
        EXPECT_EQ(config.modbus_tcp[0].name(), "0.0.0.0:503");
        EXPECT_EQ(config.modbus_tcp[0].broadcast, tcp_server::BroadcastMode::reply);
        EXPECT_THAT(imported.yaml, HasSubstr("# pause = 50: between two requests"));
    }
    EXPECT_EQ(faults("ExecStart=/usr/bin/mbusd -d -c /etc/mbusd/mbusd-%i.conf -p /dev/%i -x\n"),
              "mbusd.conf:1:32: the settings are in '/etc/mbusd/mbusd-%i.conf': import that file\n"
              "mbusd.conf:1:68: mbusd has no option '-x'\n");
    EXPECT_THAT(faults("mbusd -p /dev/tty%i\n"), HasSubstr("device must be the absolute path"));
}

TEST(MbusdConf, NamesTheProgramWhoseFileThisIs) {
    const std::pair<const char*, const char*> rows[] = {
        {"connection: &panel\n  accepter: tcp,4001\n",
         "mbusd.conf:2:1: this is a file of ser2net, which import does not read so; "
         "docs/start/from-ser2net says which key is which here\n"},
        {"4001:raw:0:/dev/ttyUSB0:9600 8DATABITS NONE 1STOPBIT\n", "a file of ser2net"},
        {"modbus:\n  - name: hub\n    type: serial\n    bytesize: 8\n",
         "4:1: this is a file of Home Assistant, which import does not read so; "
         "docs/start/from-other-programs"},
        {"[[inputs.modbus]]\n  name = \"Device\"\n", "1:1: this is a file of Telegraf"},
        {"modules:\n  - name: fake\n    metrics:\n      - metricType: gauge\n",
         "4:1: this is a file of modbus_exporter"},
    };
    for (const auto& [text, fault] : rows) EXPECT_THAT(faults(text), HasSubstr(fault));
}

TEST(MbusdConf, ReportsAllFaultsWithTheirPlaces) {
    EXPECT_EQ(
        faults("device\nspeed = fast\n  mode = 7n1\nadress = 1\nport =\ntrx_control = gpio\n"),
        "mbusd.conf:1:1: a line must be NAME = VALUE such as speed = 19200, or a comment that "
        "begins with '#', not 'device'\n"
        "mbusd.conf:2:9: speed must be a whole number from 50 to 4000000, not 'fast'\n"
        "mbusd.conf:3:10: mode must be 8 data bits, parity n, e or o, and 1 or 2 stop bits, "
        "such as 8n1, not '7n1'\n"
        "mbusd.conf:4:1: mbusd has no setting 'adress'; did you mean 'address'?\n"
        "mbusd.conf:5:7: port has no value; leave the line out for the default\n"
        "mbusd.conf:6:15: trx_control must be addc, rts_0, rts_1 (or rts), sysfs_0 or sysfs_1, "
        "not 'gpio'\n");
    const std::pair<const char*, const char*> rows[] = {
        {"device = ttyS0", "1:10: device must be the absolute path"},
        {"device = /dev/ttyS0:9600", "device must be"},
        {"address = plc.example", "address must be an IP address"},
        {"replyonbroadcast = maybe", "must be yes or no"},
        {"logfile = a\x01", "control characters"},
        {"= 5", "a line must be NAME = VALUE"},
    };
    for (const auto& [text, fault] : rows) EXPECT_THAT(faults(text), HasSubstr(fault));
}

}  // namespace
}  // namespace panelgate::mbusd::conf_test
