// qt_client HOST PORT: Qt's QModbusTcpClient with its own defaults (1 s, three retries), which
// chooses the functions by itself. It speaks the lines of plain_clients.py. matrix.py builds it
// where Qt is.
#include <QCoreApplication>
#include <QEventLoop>
#include <QModbusDataUnit>
#include <QModbusReply>
#include <QModbusTcpClient>
#include <QVariant>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>

namespace {

QModbusDataUnit::RegisterType table_of(const std::string& name) {
    if (name == "coils") return QModbusDataUnit::Coils;
    if (name == "discrete") return QModbusDataUnit::DiscreteInputs;
    if (name == "inputs") return QModbusDataUnit::InputRegisters;
    return QModbusDataUnit::HoldingRegisters;
}

void wait_for(const QModbusReply& reply) {
    QEventLoop loop;
    QObject::connect(&reply, &QModbusReply::finished, &loop, &QEventLoop::quit);
    if (!reply.isFinished()) loop.exec();
}

// `count`: of the items that were read; Qt 6 gives the rest of the last byte, too.
std::string told(const QModbusReply& reply, int count) {
    if (reply.error() == QModbusDevice::ProtocolError) {
        return "exception " + std::to_string(reply.rawResult().exceptionCode());
    }
    if (reply.error() != QModbusDevice::NoError)
        return "error " + reply.errorString().toStdString();
    std::string text = "ok";
    for (int i = 0; i < count; ++i) text += " " + std::to_string(reply.result().value(i));
    return text;
}

std::string answer(QModbusTcpClient& client, std::istream& call) {
    std::string verb, table;
    int unit = 0, address = 0;
    call >> verb >> table >> unit >> address;
    QVector<quint16> values;
    for (quint16 value = 0; call >> value;) values.append(value);
    const bool is_read = verb == "read";
    const QModbusDataUnit asked = is_read ? QModbusDataUnit(table_of(table), address, values.at(0))
                                          : QModbusDataUnit(table_of(table), address, values);
    const std::unique_ptr<QModbusReply> reply(is_read ? client.sendReadRequest(asked, unit)
                                                      : client.sendWriteRequest(asked, unit));
    if (!reply) return "error " + client.errorString().toStdString();
    wait_for(*reply);
    return told(*reply, is_read ? values.at(0) : 0);
}

}  // namespace

int main(int argc, char** argv) {
    QCoreApplication application(argc, argv);
    QModbusTcpClient client;
    client.setConnectionParameter(QModbusDevice::NetworkAddressParameter, QString(argv[1]));
    client.setConnectionParameter(QModbusDevice::NetworkPortParameter, QString(argv[2]).toInt());
    QEventLoop loop;
    QObject::connect(&client, &QModbusClient::stateChanged, &loop, [&](QModbusDevice::State state) {
        if (state == QModbusDevice::ConnectedState) loop.quit();
    });
    if (!client.connectDevice()) return 69;
    loop.exec();
    std::cout << "ready " << qVersion() << std::endl;
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream call(line);
        std::cout << answer(client, call) << std::endl;
    }
    return 0;
}
