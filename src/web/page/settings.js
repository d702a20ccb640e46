// The configuration in force, and who may access what.
import {gateway, offers} from './api.js';
import {h, table} from './dom.js';
import {duration, t, word} from './language.js';

function facts(rows) {
    return h('dl', {class: 'facts'}, rows.filter(([, value]) => value !== undefined && value !== null)
        .map(([name, value]) => h('div', null, h('dt', null, name), h('dd', null, value))));
}

const networks = (all) => all.length ? all.join(', ') : h('span', {class: 'badge warn'}, t('everybody'));
const access = (value) => h('span', {class: `badge ${value === 'read_only' ? 'good' : 'warn'}`}, word('access', value));

function http({http: door}) {
    if (!door) return null;
    const roles = {admin: 'bad', engineer: 'bad', operator: 'bad', viewer: 'warn', none: 'good'};
    return h('section', {class: 'card'}, h('h2', null, 'HTTP'), facts([[t('listens.on'), h('code', null, door.listen)],
        [t('anonymous'), h('span', {class: `badge ${roles[door.anonymous]}`}, word('role', door.anonymous))],
        [t('tokens'), door.tokens.length ? door.tokens.map((one) => `${one.name}: ${word('role', one.role)}`).join(', ') : '–'],
        [t('allow'), networks(door.allow)], [t('hosts'), door.hosts.length ? door.hosts.join(', ') : t('own.names')]]));
}

function listener(one) {
    return h('section', {class: 'card'}, h('h2', null, 'Modbus ', h('code', null, one.listen)), facts([[t('framing'), one.framing + (one.udp ? ' + udp' : '')],
        [t('access'), access(one.access)], [t('allow'), networks(one.allow)], [t('lines'), one.lines.length ? one.lines.join(', ') : t('all')],
        [t('broadcast'), one.broadcast], [t('own.unit'), one.diagnostics_unit === null ? '–' : String(one.diagnostics_unit)],
        [t('units'), Object.keys(one.units).length ? Object.entries(one.units).map(([unit, to]) => `${unit} → ${to}`).join(', ') : undefined]]));
}

function master(one) {
    return h('section', {class: 'card'}, h('h2', null, t('serial.master'), ' ', one.name), facts([[t('device'), h('code', null, one.device)], [t('serial'), one.serial],
        [t('framing'), one.framing], [t('access'), access(one.access)], [t('lines'), one.lines.join(', ') || t('all')]]));
}

function line(one) {
    const shown = table(`${t('stations')} ${one.name}`, [[t('id'), 'number'], [t('station')], [t('profile')], [t('access')], [t('guard')],
        [t('retry.writes')], [t('max.age'), 'number'], [t('nav.points'), 'number']]);
    shown.body.append(...one.stations.map((station) => h('tr', null, h('td', {class: 'number'}, String(station.id)), h('td', null, station.name), h('td', null, station.profile),
        h('td', null, access(station.access)), h('td', null, station.guard ? t('on') : t('off')), h('td', null, station.retry_writes ? t('on') : t('off')),
        h('td', {class: 'number'}, station.max_age_ms ? duration(station.max_age_ms) : '–'), h('td', {class: 'number'}, String(station.points.length)))));
    return h('section', {class: 'card'}, h('h2', null, t('line'), ' ', one.name), facts([[t('device'), h('code', null, one.device)], [t('serial'), one.serial],
        [t('mode'), word('mode', one.mode)], [t('unlisted'), word('unlisted', one.unlisted_stations)], [t('answers.within'), one.clients ? duration(one.clients.answered_within_ms) : undefined]]),
    shown.node, one.polls.length ? h('p', {class: 'muted'}, `${t('polls')}: ` + one.polls.map((poll) => `${poll.station} ${poll.read}×${poll.count} / ${duration(poll.every_ms)}`).join(', ')) : null);
}

function relays(all) {
    if (all.length === 0) return null;
    return h('section', {class: 'card'}, h('h2', null, t('nav.relays')), h('ul', {class: 'plain'}, all.map((one) =>
        h('li', null, h('code', null, `${one.from} → ${one.to}`), ` ×${one.count}, ${duration(one.every_ms)}`))));
}

function interface_(routes) {
    const shown = table('REST', [[t('method')], [t('path')], [t('role.of')]]);
    shown.body.append(...routes.map((route) => h('tr', null, h('td', null, route.method), h('td', null, h('code', null, route.path)), h('td', null, word('role', route.role)))));
    const docs = offers('GET /docs') ? h('p', null, h('a', {href: '/docs'}, t('docs'))) : null;
    return h('details', {class: 'card'}, h('summary', null, t('rest')), docs, shown.node);
}

/** What support asks for: the commit, the compiler and the libraries. */
function build() {
    if (!gateway.build) return null;
    const {commit, compiler, libraries} = gateway.build;
    const versions = Object.entries(libraries).map(([name, version]) => `${name} ${version}`);
    return h('p', {class: 'muted'}, [`commit ${commit}`, compiler, ...versions].join(' · '));
}

export function settingsView() {
    const now = gateway.configuration;
    return {node: h('div', null, h('h1', null, t('nav.settings')), h('p', {class: 'muted'}, `panelgate ${now.version} · ${t('role', {role: word('role', gateway.role)})}`), build(),
        h('h2', null, t('open.to.whom')), h('div', {class: 'columns'}, http(now), (now.modbus_tcp ?? []).map(listener), (now.serial_masters ?? []).map(master)), interface_(now.rest),
        h('h2', null, t('lines')), now.lines.map(line), relays(now.relays ?? []))};
}
