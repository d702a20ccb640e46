// What happened: the journal, the newest entry first, by kind and station.
import {get, path} from './api.js';
import {choice, h, list, table, text} from './dom.js';
import {download} from './download.js';
import {clockTime, t, word, zone} from './language.js';
import {live} from './live.js';

const PERIOD = 3000;  // ms
const PAGE = 100;     // entries
/** What people look for, and the kinds of entries that tell it. */
const KINDS = {lines: 'line_up,line_down', stations: 'station_online,station_offline', findings: 'finding,finding_gone',
    writes: 'write,refused', access: 'refused,login_failed', alarms: 'alarm_raised,alarm_cleared,alarm_acknowledged', gateway: 'start,stop,reload,standby'};

const TONES = {line_up: 'good', station_online: 'good', alarm_cleared: 'good', alarm_acknowledged: 'none', line_down: 'bad', station_offline: 'bad', alarm_raised: 'bad'};

function row(entry) {
    const place = [entry.station || entry.line, entry.point].filter((part) => part !== '').join('/');
    const tone = TONES[entry.kind] ?? (entry.severity === 'info' ? 'none' : 'warn');
    return {node: h('tr', {'data-kind': entry.kind}, h('td', {class: 'figure'}, clockTime(Date.parse(entry.time))),
        h('td', null, h('span', {class: `badge ${tone}`}, word('event', entry.kind))), h('td', {class: 'wide'}, place === '' ? null : h('strong', null, place, ' '), entry.text), h('td', null, entry.who))};
}

export function journalView({argument, detail}) {
    const shown = table(t('nav.journal'), [[`${t('time')} (${zone})`], [t('kind')], [t('what')], [t('who')]]);
    const none = h('p', {class: 'empty', hidden: true}, t('journal.none'));
    const failed = h('p', {class: 'problem', hidden: true});
    let kind = KINDS[argument] ? argument : '';
    let station = live.stations.some((one) => one.name === detail) ? detail : '';
    let entries = [];
    let next = null;
    let older = false;
    let ended = false;
    const query = (more) => {
        const parts = new URLSearchParams({limit: PAGE, ...kind ? {kind: KINDS[kind]} : {}, ...station ? {station} : {}, ...more});
        return `${path('journal')}?${parts}`;
    };
    const away = h('span');
    const show = () => {
        list(shown.body, entries, (entry) => String(entry.id), row);
        none.hidden = entries.length > 0;
        shown.node.hidden = entries.length === 0;
        button.hidden = next === null;
        away.replaceChildren(download(query({limit: 1000}), 'journal.csv', 'CSV', {}, 'text/csv'));
    };
    const ask = async (more = {}) => {
        try {
            const page = await get(query(more));
            if (ended) return;
            entries = more.after ? [...entries, ...page.entries] : page.entries;
            next = page.next;
            failed.hidden = true;
            show();
        } catch (error) {
            failed.hidden = error.status === 0;  // the bar above the page says it
            text(failed, error.message);
        }
    };
    const button = h('button', {type: 'button', hidden: true, onclick: () => { older = true; ask({after: next}); }}, t('older'));
    const again = () => { older = false; ask(); };
    const kinds = choice(t('kind'), [['', t('all')], ...Object.keys(KINDS).map((name) => [name, t('journal.' + name)])], kind, (chosen) => { kind = chosen; again(); });
    const stations = choice(t('station'), [['', t('all')], ...live.stations.map((one) => [one.name, one.name])], station, (chosen) => { station = chosen; again(); });
    const node = h('div', null, h('h1', null, t('nav.journal')), h('div', {class: 'bar'}, h('label', null, t('kind'), ' ', kinds), h('label', null, t('station'), ' ', stations), away), failed, shown.node, none, button);
    ask();
    const timer = setInterval(() => document.hidden || older || ask(), PERIOD);
    return {node, stop: () => { ended = true; clearInterval(timer); }};
}
