// libmodbus_bridge TTY BAUD: the bridge of libmodbus' manual pages, as a user writes it: TCP clients
// in one loop, each request read from the panel with libmodbus' own RTU master before the next.
// It knows of no silence between frames. Prints "listening PORT".
#include <arpa/inet.h>
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/select.h>
#include <unistd.h>

static void fail(const char *what) {
    fprintf(stderr, "libmodbus_bridge: %s: %s\n", what, modbus_strerror(errno));
    exit(69);
}

static void answer(modbus_t *tcp, modbus_t *rtu, modbus_mapping_t *map, const uint8_t *query, int length) {
    const int unit = query[6], function = query[7];
    const int address = query[8] << 8 | query[9], count = query[10] << 8 | query[11];
    int done = -1;
    modbus_set_slave(rtu, unit);
    switch (function) {
        case MODBUS_FC_READ_HOLDING_REGISTERS:
            done = modbus_read_registers(rtu, address, count, map->tab_registers + address);
            break;
        case MODBUS_FC_WRITE_SINGLE_REGISTER:
            done = modbus_write_register(rtu, address, (uint16_t)count);
            break;
        default:
            modbus_reply_exception(tcp, query, MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
            return;
    }
    if (done < 0) {
        modbus_flush(rtu);
        modbus_reply_exception(tcp, query, MODBUS_EXCEPTION_GATEWAY_TARGET);
    } else {
        modbus_reply(tcp, query, length, map);
    }
}

int main(int argc, char **argv) {
    if (argc != 3) return 64;
    // A pseudo-terminal has no parity, and glibc refuses it where nothing else changes.
    modbus_t *rtu = modbus_new_rtu(argv[1], atoi(argv[2]), 'N', 8, 1);
    if (rtu == NULL || modbus_connect(rtu) != 0) fail(argv[1]);
    modbus_t *tcp = modbus_new_tcp("127.0.0.1", 0);
    const int listener = modbus_tcp_listen(tcp, 1024);
    if (listener < 0) fail("listen");
    modbus_mapping_t *map = modbus_mapping_new(0, 0, 65536, 0);
    struct sockaddr_in own;
    socklen_t size = sizeof own;
    getsockname(listener, (struct sockaddr *)&own, &size);
    printf("listening %d\n", ntohs(own.sin_port));
    fflush(stdout);

    fd_set all;
    FD_ZERO(&all);
    FD_SET(listener, &all);
    int last = listener;
    for (;;) {
        fd_set ready = all;
        if (select(last + 1, &ready, NULL, NULL, NULL) < 0) fail("select");
        for (int fd = 0; fd <= last; ++fd) {
            if (!FD_ISSET(fd, &ready)) continue;
            if (fd == listener) {
                const int client = accept(listener, NULL, NULL);
                if (client >= FD_SETSIZE) close(client);
                if (client < 0 || client >= FD_SETSIZE) continue;
                FD_SET(client, &all);
                if (client > last) last = client;
                continue;
            }
            uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
            modbus_set_socket(tcp, fd);
            const int length = modbus_receive(tcp, query);
            if (length > 0) {
                answer(tcp, rtu, map, query, length);
            } else if (length < 0) {
                close(fd);
                FD_CLR(fd, &all);
            }
        }
    }
}
