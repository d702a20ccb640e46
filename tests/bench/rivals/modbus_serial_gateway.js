// modbus_serial_gateway.js TTY BAUD: npm's modbus-serial on both sides, as its examples have it: a
// TCP server whose reads ask its RTU client, one after the other. Prints "listening PORT".
"use strict";
const net = require("net");
const ModbusRTU = require("modbus-serial");

const [tty, baud] = [process.argv[2], Number(process.argv[3])];
const client = new ModbusRTU();
let last = Promise.resolve();

// A client has one unit id at a time: who comes later waits for who came before.
function inTurn(unit, ask) {
    const turn = last.then(() => {
        client.setID(unit);
        return ask();
    });
    last = turn.catch(() => {});
    return turn;
}

const vector = {
    getHoldingRegister: (address, unit) =>
        inTurn(unit, () => client.readHoldingRegisters(address, 1)).then((reply) => reply.data[0]),
    getMultipleHoldingRegisters: (address, count, unit, done) => {
        inTurn(unit, () => client.readHoldingRegisters(address, count))
            .then((reply) => done(null, reply.data), (error) => done(error));
    },
    setRegister: (address, value, unit) =>
        inTurn(unit, () => client.writeRegister(address, value)),
};

// ServerTCP takes port 0 for 502.
function freePort() {
    return new Promise((resolve) => {
        const probe = net.createServer().listen(0, "127.0.0.1", () => {
            const { port } = probe.address();
            probe.close(() => resolve(port));
        });
    });
}

async function main() {
    await client.connectRTUBuffered(tty, { baudRate: baud, parity: "even", dataBits: 8, stopBits: 1 });
    client.setTimeout(1000);
    const port = await freePort();
    const server = new ModbusRTU.ServerTCP(vector, { host: "127.0.0.1", port, unitID: 255 });
    server.on("initialized", () => console.log("listening", port));
    server.on("socketError", () => {});
}

main();
