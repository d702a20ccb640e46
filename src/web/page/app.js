// The page: what is shown where, in which language and theme.
import {forgetToken, gateway, hasToken, introduce, mayConfigure, offers} from './api.js';
import {attribute, choice, h, replace, text} from './dom.js';
import {language, languages, store, stored, t} from './language.js';
import {configurationView} from './configuration.js';
import {discoveryView} from './discovery.js';
import {helpLink} from './help.js';
import {latencyView} from './latency.js';
import {live} from './live.js';
import {overviewView, tone} from './overview.js';
import {clientsView, relaysView} from './plain_views.js';
import {pointsView} from './points.js';
import {requestView} from './request.js';
import {scopeView} from './scope.js';
import {settingsView} from './settings.js';
import {stationView} from './station.js';
import {roleButton, signIn} from './token.js';

const VIEWS = {'': overviewView, scope: scopeView, latency: latencyView, points: pointsView, relays: relaysView,
    clients: clientsView, request: requestView, discovery: discoveryView, text: configurationView, settings: settingsView, station: stationView};
const NAMED = {'': 'overview', scope: 'scope', latency: 'latency', points: 'points', relays: 'relays', clients: 'clients',
    request: 'request', discovery: 'discovery', text: 'text', settings: 'settings'};
/** Sections of the manual's page on this page: what the view is called in English. */
const EXPLAINED = {...NAMED, '': 'overview', scope: 'bus-scope', text: 'the-configuration-file', settings: 'configuration', station: 'a-station'};
/** Views that not everybody has: the gateway may lack the paths, and who looks the right. */
const NEEDS = {discovery: () => offers('POST /api/v1/lines/{}/discover'), text: mayConfigure};
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

/** What there is whoever one is: names, and what is chosen, behind who one is. */
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
}

/** A tab that nobody looks at says how many do not answer. */
function entitle() {
    const silent = live.stations.filter((station) => tone(station.state) === 'bad').length;
    const name = `${main.querySelector('h1')?.textContent.trim() ?? ''} · panelgate`;
    document.title = silent > 0 ? `⚠ ${silent} · ${name}` : name;
}

function show() {
    const [, name = '', ...parts] = location.hash.split('/');
    const view = has(name) ? name : '';
    const [argument, detail] = parts.map((part) => part === '' ? undefined : decodeURIComponent(part));
    shown?.stop?.();
    shown = VIEWS[view]({argument, detail});
    replace(main, shown.node);
    shown.update?.();
    for (const link of document.querySelectorAll('#nav a')) attribute(link, 'aria-current', link.dataset.view === view ? 'page' : null);
    entitle();
    help.update(EXPLAINED[view], NAMED[view] ? t('nav.' + NAMED[view]) : t('station'));
    main.dataset.view = view;
    window.scrollTo(0, 0);
}

function refresh() {
    banner.hidden = live.reachable;
    if (!live.reachable) text(banner, t('unreachable'));
    entitle();
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
        banner.hidden = false;
        text(banner, t('unreachable'));
        setTimeout(start, 2000);
        return;
    }
    build();
    await first;
    if (live.refused) await live.refresh();
    live.addEventListener('status', refresh);
    live.addEventListener('refused', () => location.reload());
    live.start();
    window.addEventListener('hashchange', () => { show(); main.focus(); });
    document.addEventListener('role', () => { link(); show(); });
    show();
    performance.mark('shown');
}

start();
