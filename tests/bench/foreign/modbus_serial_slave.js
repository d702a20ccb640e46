// modbus_serial_slave.js TTY BAUD UNIT: the serial server of npm's modbus-serial. It prints `ready`.
// A holding register holds unit * 257 + address * 31 + 7 until somebody writes it.
"use strict";
const { ServerSerial } = require("modbus-serial");

const [tty, baud, unit] = [process.argv[2], Number(process.argv[3]), Number(process.argv[4])];
const registers = new Map();
const coils = new Map();
const memory = {
    getHoldingRegister: (address) =>
        registers.get(address) ?? ((unit * 257 + address * 31 + 7) & 0xffff),
    getCoil: (address) => coils.get(address) ?? false,
    setRegister: (address, value) => { registers.set(address, value); },
    setCoil: (address, value) => { coils.set(address, value); },
};
const server = new ServerSerial(memory, { port: tty, baudRate: baud, unitID: unit });
server.on("initialized", () => console.log("ready"));
server.on("error", (error) => console.error(error.message));
server.on("socketError", (error) => console.error(error.message));
