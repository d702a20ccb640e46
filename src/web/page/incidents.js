// What the flight recorder has frozen around errors, to be taken away.
import {get, offers, path, seesWhole} from './api.js';
import {h, list, table} from './dom.js';
import {download} from './download.js';
import {t, time, word, zone} from './language.js';
import {live} from './live.js';

const PERIOD = 3000;  // ms

/** A line's incidents: {node, stop}; nothing where the gateway keeps none. */
export function incidents(line) {
    const node = h('section', {hidden: true});
    if (!offers('GET /api/v1/lines/{}/incidents') || !seesWhole(line)) return {node, stop: () => {}};
    const shown = table(t('incidents'), [[`${t('time')} (${zone})`], [t('station')], [t('kind')], [t('errors'), 'number'], ['']]);
    node.append(h('h2', null, t('incidents')), shown.node);
    const row = (one) => {
        const away = (ending, name) => download(path('lines', line, 'incidents', one.id + ending), `${line}-${one.id}${ending || '.json'}`, name);
        return {node: h('tr', null, h('td', {class: 'figure'}, time(Date.parse(one.time) / 1000)),
            h('td', null, live.at(line, one.station)?.name ?? String(one.station ?? '')), h('td', null, word('cause', one.cause)),
            h('td', {class: 'number'}, String(one.errors)), h('td', null, away('', 'JSON'), ' ', away('.pcapng', 'pcapng')))};
    };
    const ask = async () => {
        try {
            const all = (await get(path('lines', line, 'incidents'))).incidents;
            list(shown.body, all.toReversed(), (one) => one.id, row);
            node.hidden = all.length === 0;
        } catch (error) {  // without an answer the bar above the page says why
            if (error.status === 403) clearInterval(timer);
        }
    };
    ask();
    const timer = setInterval(() => document.hidden || ask(), PERIOD);
    return {node, stop: () => clearInterval(timer)};
}
