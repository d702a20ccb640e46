// The page: what is shown where, in which language and theme.
import {alarms, alarmsView} from './alarms.js';
import {forgetToken, gateway, hasToken, introduce, mayConfigure, offers} from './api.js';
import {attribute, choice, h, replace, text} from './dom.js';
import {clockTime, language, languages, store, stored, t, zone} from './language.js';
import {configurationView} from './configuration.js';
import {discoveryView} from './discovery.js';
import {helpLink} from './help.js';
import {historyView} from './history.js';
import {journalView} from './journal.js';
import {latencyView} from './latency.js';
import {live} from './live.js';
import {overviewView, troubles} from './overview.js';
import {clientsView, relaysView} from './plain_views.js';
import {pointsView} from './points.js';
import {requestView} from './request.js';
import {scopeView} from './scope.js';
import {settingsView} from './settings.js';
import {stationView} from './station.js';
import {roleButton, signIn} from './token.js';

const VIEWS = {'': overviewView, alarms: alarmsView, journal: journalView, history: historyView, scope: scopeView, latency: latencyView, points: pointsView, relays: relaysView,
    clients: clientsView, request: requestView, discovery: discoveryView, text: configurationView, settings: settingsView, station: stationView};
const NAMED = {'': 'overview', alarms: 'alarms', journal: 'journal', history: 'history', scope: 'scope', latency: 'latency', points: 'points', relays: 'relays', clients: 'clients',
    request: 'request', discovery: 'discovery', text: 'text', settings: 'settings'};
/** Sections of the manual's page on this page: what the view is called in English. */
const EXPLAINED = {...NAMED, '': 'overview', journal: 'events', scope: 'bus-scope', text: 'the-configuration-file', settings: 'configuration', station: 'a-station'};
/** Views that not everybody has: the gateway may lack the paths, and who looks the right. */
const NEEDS = {alarms: () => offers('GET /api/v1/alarms'), journal: () => offers('GET /api/v1/journal'), history: () => offers('GET /api/v1/journal'),
    discovery: () => offers('POST /api/v1/lines/{}/discover'), text: mayConfigure};
const has = (name) => VIEWS[name] && (NEEDS[name]?.() ?? true);
const THEMES = ['auto', 'light', 'dark'];

const main = document.getElementById('main');
const banner = document.getElementById('banner');
const help = helpLink();
let shown = null;

function theme(chosen) {
    attribute(document.documentElement, 'data-theme', chosen === 'auto' ? null : chosen);
    store('theme', chosen);
}

/** The tools of the head, with and without a role: `who` comes first, then language, theme and help. */
function tools(...who) {
    attribute(document.getElementById('nav'), 'aria-label', t('nav'));
    attribute(document.getElementById('menu'), 'aria-label', t('menu'));
    text(document.getElementById('skip'), t('skip'));
    replace(document.getElementById('tools'), who,
        choice(t('language'), languages, language, (chosen) => { store('language', chosen); location.reload(); }),
        choice(t('theme'), THEMES.map((name) => [name, t('theme.' + name)]), stored('theme') ?? 'auto', theme), help.node);
}

function link() {
    replace(document.getElementById('nav'), Object.entries(NAMED).filter(([name]) => has(name)).map(([name, key]) =>
        h('a', {href: `#/${name}`, 'data-view': name}, t('nav.' + key))));
}

function build() {
    const nav = document.getElementById('nav');
    link();
    const menu = document.getElementById('menu');
    menu.addEventListener('click', () => open(nav.hidden || !nav.classList.contains('open')));
    const open = (yes) => {
        nav.classList.toggle('open', yes);
        attribute(menu, 'aria-expanded', String(yes));
    };
    nav.addEventListener('click', () => open(false));
    tools(roleButton());
    text(document.getElementById('version'), gateway.configuration.version);
    text(document.getElementById('foot'), t('times', {zone}));
}

/** A tab that nobody looks at says how many do not answer, or that nobody knows. */
function entitle() {
    const {down, bad} = troubles();
    const waiting = alarms.waiting.length;
    const name = `${main.querySelector('h1')?.textContent.trim() ?? ''} · panelgate`;
    const trouble = !live.reachable ? t('state.suspect') : (bad || down || live.findings.length) + waiting;
    document.title = trouble ? `⚠ ${trouble} · ${name}` : name;
    const link = document.querySelector('#nav a[data-view="alarms"]');
    if (link) text(link, waiting > 0 ? `${t('nav.alarms')} (${waiting})` : t('nav.alarms'));
}

/** What is old is grey; a gateway that does not answer is one red bar. */
function warn() {
    document.body.classList.toggle('old', live.old);
    banner.hidden = live.reachable;
    if (!live.reachable) text(banner, live.heard === 0 ? t('unreachable') : t('unreachable.since', {time: clockTime(live.heard)}));
    entitle();
}

function show() {
    const [, name = '', ...parts] = location.hash.split('/');
    const view = has(name) ? name : '';
    const [argument, detail] = parts.map((part) => part === '' ? undefined : decodeURIComponent(part));
    shown?.stop?.();
    shown = VIEWS[view]({argument, detail});
    for (const open of document.querySelectorAll('dialog')) open.close();
    replace(main, name === view ? null : h('p', {class: 'finding', id: 'no-view'}, t('view.unknown')), shown.node);
    shown.update?.();
    for (const link of document.querySelectorAll('#nav a')) attribute(link, 'aria-current', link.dataset.view === view ? 'page' : null);
    entitle();
    help.update(EXPLAINED[view], NAMED[view] ? t('nav.' + NAMED[view]) : t('station'));
    main.dataset.view = view;
    window.scrollTo(0, 0);
}

function refresh() {
    warn();
    shown?.update?.();
}

/** introduce(); is who we are known? */
async function known() {
    try {
        await introduce();
        return true;
    } catch (error) {
        if (error.status !== 401) throw error;
        return false;
    }
}

/** Ends when we may look. A token that this tab remembers may be none any more. */
async function enter() {
    if (await known()) return;
    const forgotten = hasToken();
    forgetToken();
    if (forgotten && await known()) return;
    tools();
    help.update(null, t('token'));
    await signIn(main, forgotten);
}

async function start() {
    theme(stored('theme') ?? 'auto');
    const first = live.refresh();
    try {
        await enter();
    } catch {
        await first;
        live.reachable = false;
        warn();
        setTimeout(start, 2000);
        return;
    }
    build();
    await first;
    if (live.refused) await live.refresh();
    live.addEventListener('status', refresh);
    live.addEventListener('refused', () => location.reload());
    live.start();
    alarms.addEventListener('change', entitle);
    alarms.start();
    window.addEventListener('hashchange', () => { show(); main.focus(); });
    document.addEventListener('role', () => { link(); show(); });
    show();
    performance.mark('shown');
}

start();
