// Relays, and the clients of the lines.
import {get, path} from './api.js';
import {attribute, h, list, table, text} from './dom.js';
import {duration, number, t, word} from './language.js';
import {live} from './live.js';

/** A view that asks again and again: {node, update, stop}. */
function asking(node, ask, period = 2000) {
    let last = -Infinity;
    let ended = false;
    const update = async () => {
        if (performance.now() - last < period) return;
        last = performance.now();
        try { await ask(() => ended); } catch { /* the bar above the page says it */ }
    };
    return {node, update, stop: () => { ended = true; }};
}

function relayRow(first) {
    const state = h('span', {lang: 'en'});
    const why = h('span', {lang: 'en'});
    const cells = Array.from({length: 4}, () => h('td', {class: 'number'}));
    return {node: h('tr', null, h('th', {scope: 'row'}, first.name), h('td', null, state, ' ', why), cells), update: (relay) => {
        const [name, ...reason] = relay.state.split(': ');
        attribute(state, 'class', `badge ${relay.state === 'ok' ? 'good' : 'bad'}`);
        text(state, name);
        text(why, reason.join(': '));
        [`${number(relay.reads)} / ${number(relay.read_failures)}`, `${number(relay.writes)} / ${number(relay.write_failures)}`, number(relay.repairs),
            duration(relay.last_write_ms)].forEach((value, i) => text(cells[i], value));
    }};
}

export function relaysView() {
    const shown = table(t('nav.relays'), [[t('relay')], [t('state')], [t('reads'), 'number'], [t('writes'), 'number'], [t('repairs'), 'number'], [t('last.write'), 'number']]);
    const none = h('p', {class: 'empty', hidden: true}, t('no.relays'));
    return asking(h('div', null, h('h1', null, t('nav.relays')), shown.node, none), async () => {
        const {relays} = await get(path('relays'));
        list(shown.body, relays, (relay) => relay.name, relayRow);
        none.hidden = relays.length > 0;
        shown.node.hidden = relays.length === 0;
    });
}

/** What there is to tell of a client besides its share: [words, does the gateway tell it, value]. */
const CLIENT = [
    ['transactions', () => true, (client) => number(client.transactions)],
    ['bus.time', () => true, (client) => duration(client.busy_seconds * 1000)],
    ['requests', (client) => 'requests' in client, (client) => `${number(client.requests)} / ${number(client.failed)}`],
    ['last.error', (client) => 'last_error' in client, (client) => client.last_error === null ? '–'
        : t('ago', {what: word('outcome', client.last_error), ago: duration(client.last_error_ms)})],
];

/** The gateway's own in the reader's language; servers' clients are called as the log does. */
export function clientName(name) {
    if (name === 'others') return t('clients.others');
    const poll = /^poll of (.+)$/.exec(name);
    return poll ? t('clients.poll', {station: poll[1]}) : name;
}

function clientRow(first) {
    const name = clientName(first.name);
    const gone = h('small', {class: 'muted'});
    const share = h('meter', {min: 0, max: 100, 'aria-label': t('share.of', {name})});
    const percent = h('span', {class: 'figure'});
    const told = CLIENT.filter(([, tells]) => tells(first));
    const cells = told.map(() => h('td', {class: 'number'}));
    return {node: h('tr', {'data-client': first.name}, h('th', {scope: 'row'}, name, ' ', gone), h('td', null, h('div', {class: 'share'}, percent, share)), cells), update: (client) => {
        share.value = client.percent;
        text(gone, (client.gone_ms ?? null) === null ? '' : t('clients.gone', {ago: duration(client.gone_ms)}));
        text(percent, `${number(client.percent, 1)} %`);
        told.forEach(([, , value], i) => text(cells[i], value(client)));
    }};
}

function clientsOf(line) {
    const node = h('section', null, h('h2', null, line));
    let shown = null;
    return {node, show: (clients) => {
        if (!shown && clients.length > 0) {
            const told = CLIENT.filter(([, tells]) => tells(clients[0]));
            shown = table(`${t('nav.clients')} ${line}`, [[t('client')], [t('share')], ...told.map(([name]) => [t(name), 'number'])]);
            node.append(shown.node);
        }
        const sorted = [...clients].sort((a, b) => b.percent - a.percent || a.name.localeCompare(b.name));
        if (shown) list(shown.body, sorted, (client) => client.name, clientRow);
    }};
}

export function clientsView() {
    const lines = live.lines.map((line) => ({name: line.name, ...clientsOf(line.name)}));
    const node = h('div', null, h('h1', null, t('nav.clients')), h('p', {class: 'muted'}, t('clients.hint')), lines.map((line) => line.node));
    return asking(node, async (ended) => {
        for (const line of lines) {
            if (ended()) return;
            line.show((await get(path('lines', line.name))).clients);
        }
    });
}
