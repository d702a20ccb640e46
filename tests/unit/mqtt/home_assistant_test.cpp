#include "panelgate/mqtt/home_assistant.hpp"

#include <gmock/gmock.h>

#include <boost/json/parse.hpp>

#include "mqtt_plant.hpp"

namespace panelgate::mqtt::home_assistant_test {
namespace {

namespace json = boost::json;
using ::testing::HasSubstr;

class HomeAssistant : public ::testing::Test {
  protected:
    HomeAssistant() {
        settings_.topic = "plant/hall";
        settings_.write = true;
        setpoint_.unit = "celsius";
        setpoint_.scale = 0.1;
        setpoint_.writable = true;
        setpoint_.max = Decimal(60.0);
        mode_.labels = {{0, "off"}, {2, "it's on"}};
        mode_.writable = true;
        valve_.writable = true;
        energy_.unit = "kWh";
    }
    json::object components() const {
        const std::vector<const points::Point*> all{&setpoint_, &mode_, &valve_, &energy_, &name_};
        const Notice notice = home_assistant_notice(settings_, {"press", "autonics-gplp-s", all});
        EXPECT_EQ(notice.topic, "homeassistant/device/plant_hall_press/config");
        return json::parse(notice.payload).at("cmps").as_object();
    }

    Settings settings_;
    points::Point setpoint_ = point("setpoint", points::Type::i16);
    points::Point mode_ = point("mode", points::Type::u16);
    points::Point valve_ = point("valve", points::Type::boolean);
    points::Point energy_ = point("energy", points::Type::u32);
    points::Point name_ = point("name", points::Type::string);
};

TEST_F(HomeAssistant, WritablePointsAreNumbersSelectsAndSwitches) {
    const json::object all = components();
    const json::object& number = all.at("setpoint").as_object();
    EXPECT_EQ(number.at("p"), "number");
    EXPECT_EQ(number.at("unique_id"), "plant_hall_press_setpoint");
    EXPECT_EQ(number.at("command_topic"), "plant/hall/press/setpoint/set");
    EXPECT_EQ(number.at("unit_of_measurement"), "°C");
    EXPECT_EQ(number.at("device_class"), "temperature");
    EXPECT_EQ(number.at("max").to_number<double>(), 60);
    EXPECT_EQ(number.at("step").to_number<double>(), 0.1);
    const json::object& select = all.at("mode").as_object();
    EXPECT_EQ(select.at("p"), "select");
    EXPECT_EQ(select.at("options"), (json::array{"off", "it's on"}));
    EXPECT_EQ(select.at("command_template"), R"({{ {"off":0,"it's on":2}[value] }})");
    EXPECT_EQ(all.at("valve").at("p"), "switch");
    EXPECT_EQ(all.at("valve").at("payload_on"), "true");
}

TEST_F(HomeAssistant, WithoutWritesAllAreSensors) {
    settings_.write = false;
    const json::object all = components();
    EXPECT_EQ(all.at("setpoint").at("p"), "sensor");
    EXPECT_EQ(all.at("setpoint").at("state_class"), "measurement");
    EXPECT_EQ(all.at("energy").at("state_class"), "total_increasing");
    EXPECT_EQ(all.at("valve").at("p"), "binary_sensor");
    EXPECT_EQ(all.at("mode").at("p"), "sensor");
    EXPECT_FALSE(all.at("name").as_object().contains("state_class"));
    for (const auto& [name, component] : all)
        EXPECT_FALSE(component.as_object().contains("command_topic")) << std::string(name);
}

TEST_F(HomeAssistant, AComponentThatGoesIsTakenAwayBeforeTheOthersAreTold) {
    const auto notice = [&](std::vector<const points::Point*> all) {
        return home_assistant_notice(settings_, {"press", "generic", std::move(all)}).payload;
    };
    const std::string both = notice({&setpoint_, &valve_});
    const std::string one = notice({&setpoint_});
    const json::value gone = json::parse(home_assistant_farewell(both, one));
    EXPECT_EQ(gone.at("cmps").at("valve"), (json::object{{"p", "switch"}}));
    EXPECT_EQ(gone.at("cmps").at("setpoint").at("p"), "number");
    EXPECT_EQ(home_assistant_farewell(one, both), "");

    Settings settings = settings_;
    Subjects before;
    before.add_notice("homeassistant/device/a/config", both);
    before.add_notice("homeassistant/device/b/config", one);
    Subjects now;
    now.add_notice("homeassistant/device/a/config", one);
    Publisher former(settings, before);
    former.connected();
    EXPECT_EQ(take_all(former).size(), 3U) << "status and two notices";
    Publisher publisher(settings, now);
    publisher.take_over(former);
    publisher.connected();
    std::string told;
    for (const auto& [message, change] : take_all(publisher))
        told += message.topic + ' ' + message.payload + '\n';
    EXPECT_THAT(told, HasSubstr("device/b/config \n"));
    EXPECT_THAT(told, HasSubstr(R"("valve":{"p":"switch"})"));
    EXPECT_THAT(told, HasSubstr("device/a/config " + one + '\n'));
    EXPECT_LT(told.find(R"("valve")"), told.find("device/a/config " + one));
}

}  // namespace
}  // namespace panelgate::mqtt::home_assistant_test
