// A Modbus frame, part by part (Modbus Application Protocol V1.1b3, chapter 6). Pure.

const TABLES = {1: 'coils', 2: 'discrete-inputs', 3: 'holding-registers', 4: 'input-registers',
    5: 'coils', 6: 'holding-registers', 15: 'coils', 16: 'holding-registers', 22: 'holding-registers',
    23: 'holding-registers'};

const SHORTEST = 4;  // address, function, CRC

export const tableOf = (code) => TABLES[code & 0x7F] ?? null;
export const isBits = (table) => table === 'coils' || table === 'discrete-inputs';
export const hex = (bytes) => bytes.map((byte) => byte.toString(16).toUpperCase().padStart(2, '0')).join(' ');

const u16 = (bytes, at) => bytes[at] << 8 | bytes[at + 1];

/** Values of data bytes: 16 bits each, or single bits from the lowest of the first byte on. */
export function valuesOf(bytes, table, count) {
    if (isBits(table)) {
        return Array.from({length: count}, (_, i) => bytes[i >> 3] >> (i & 7) & 1);
    }
    return Array.from({length: bytes.length >> 1}, (_, i) => u16(bytes, 2 * i));
}

class Parts {
    constructor(bytes) {
        this.bytes = bytes;
        this.at = 0;
        this.fields = [];
        this.end = bytes.length < SHORTEST ? bytes.length : bytes.length - 2;  // of what stands before the CRC
    }
    /** The next bytes as a field; `kind` is a key of the words, `value` what they say. */
    take(kind, length, value) {
        const size = Math.min(length, this.end - this.at);
        if (size <= 0) return null;
        const bytes = this.bytes.slice(this.at, this.at + size);
        const shown = value ? value(bytes) : size === 2 ? u16(bytes, 0) : bytes[0];
        this.fields.push({kind, from: this.at, bytes, value: shown});
        this.at += size;
        return shown;
    }
    rest(kind) { this.take(kind, this.end - this.at, (bytes) => hex(bytes)); }
}

function requestParts(parts, code, found) {
    found.address = parts.take('address', 2);
    if (code === 5) found.values = [parts.take('value', 2, (b) => u16(b, 0) === 0xFF00 ? 1 : 0)];
    else if (code === 6) found.values = [parts.take('value', 2)];
    else if (code === 22) { parts.take('and-mask', 2); parts.take('or-mask', 2); }
    else {
        found.count = parts.take('count', 2);
        if (code === 23) { found.writeAddress = parts.take('write-address', 2); parts.take('write-count', 2); }
        if (code === 15 || code === 16 || code === 23) {
            const length = parts.take('byte-count', 1);
            found.values = parts.take('values', length, (b) => valuesOf(b, found.table, found.count)) ?? [];
        }
    }
    found.count ??= 1;
}

function replyParts(parts, code, found, request) {
    const reads = code <= 4 || code === 23;
    if (!reads) {
        if (code === 15 || code === 16) {
            found.address = parts.take('address', 2);
            found.count = parts.take('count', 2);
        } else requestParts(parts, code, found);
        return;
    }
    const length = parts.take('byte-count', 1);
    found.address = request?.address ?? null;
    const bits = request?.count ?? 8 * length;
    found.values = parts.take('values', length, (b) => valuesOf(b, found.table, bits)) ?? [];
    found.count = found.values.length;
}

/**
 * The fields of a frame, and what it is about: {fields: [{kind, from, bytes, value}], station, code,
 * table, address, count, values, exception}. `request`: explained, of the frame that this answers.
 */
export function explain(bytes, isReply, request = null) {
    const parts = new Parts(bytes);
    const found = {fields: parts.fields, table: null, address: null, values: null, exception: null};
    found.station = parts.take('station', 1);
    found.code = parts.take('function', 1);
    found.table = tableOf(found.code ?? 0);
    if (found.code & 0x80) found.exception = parts.take('exception', 1);
    else if (found.table && isReply) replyParts(parts, found.code, found, request);
    else if (found.table) requestParts(parts, found.code, found);
    parts.rest('data');
    if (bytes.length >= SHORTEST) {
        parts.fields.push({kind: 'crc', from: parts.end, bytes: bytes.slice(parts.end), value: null});
    }
    return found;
}
