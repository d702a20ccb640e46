// Of the manual: the theme (the dashboard's), and the search. No module, so that it works from a folder, too.
'use strict';
(() => {
    const MOST = 30;          // results that are shown
    const AROUND = 60;        // characters of a sentence before what was found
    const SHOWN = 200;
    const base = document.currentScript.dataset.base;
    const of = (id) => document.getElementById(id);
    const remembered = () => { try { return localStorage.getItem('panelgate.theme') ?? 'auto'; } catch { return 'auto'; } };
    let pages = null;

    function dress(theme) {
        if (theme === 'auto') document.documentElement.removeAttribute('data-theme');
        else document.documentElement.dataset.theme = theme;
    }

    function chooseTheme() {
        const select = of('site-theme');
        select.hidden = false;
        select.value = remembered();
        select.addEventListener('change', () => {
            dress(select.value);
            try { localStorage.setItem('panelgate.theme', select.value); } catch { /* for this page only */ }
        });
    }

    /** The index comes when somebody wants it. */
    function fetchIndex() {
        if (pages) return;
        pages = [];
        window.manual = (rows) => { pages = rows; look(); };
        const script = document.createElement('script');
        script.src = base + 'search.js';
        document.head.append(script);
    }

    const letters = (text) => text.toLowerCase();
    const literally = (word) => word.replace(/[.*+?^${}()|[\]\\/]/g, '\\$&');

    /** Of a part of a page: how many of the words it has, and how well it fits. */
    function score(words, title, heading, text) {
        let sum = 0, has = 0;
        for (const word of words) {
            const there = (where) => where.includes(word) ? (new RegExp('(^|[^\\p{L}\\p{N}])' + literally(word), 'u').test(where) ? 2 : 1) : 0;
            const found = 20 * there(heading) + 8 * there(title) + there(text);
            if (found > 0) ++has;
            sum += found;
        }
        return [has, sum];
    }

    /** The parts that have all words; where there is none, those that have the most of them. */
    function search(words) {
        const found = [];
        for (const [name, title, parts] of pages) {
            for (const [id, heading, text] of parts) {
                const [has, fits] = score(words, letters(title), letters(heading), letters(text));
                // A page is found before its parts, where its title has all the words.
                const whole = id === '' ? (words.every((word) => letters(title).includes(word)) ? 10 * words.length : 4) : 0;
                if (has > 0) found.push({way: base + name + (id ? '#' + id : ''), title, heading, text, has, fits: fits + whole});
            }
        }
        const most = Math.max(...found.map((one) => one.has));
        return found.filter((one) => one.has === most).sort((one, other) => other.fits - one.fits);
    }

    /** Some words around the first one that was found, with all of them marked. */
    function excerpt(text, words) {
        const first = Math.min(...words.map((word) => letters(text).indexOf(word)).filter((at) => at >= 0), text.length);
        const from = first === text.length ? 0 : Math.max(0, text.lastIndexOf(' ', Math.max(0, first - AROUND)) + 1);
        const shown = text.slice(from, from + SHOWN).replace(text.length > from + SHOWN ? /\s\S*$/ : '', '');
        const node = document.createElement('small');
        const any = new RegExp('(' + words.map((word) => literally(word)).join('|') + ')', 'giu');
        shown.split(any).forEach((piece, i) => {
            if (i % 2 === 0) return node.append(piece);
            const mark = document.createElement('mark');
            mark.textContent = piece;
            return node.append(mark);
        });
        return node;
    }

    function row(one, words) {
        const item = document.createElement('li');
        const link = document.createElement('a');
        const name = document.createElement('b');
        name.textContent = one.heading;
        link.href = one.way;
        link.append(name, one.title === one.heading ? '' : ' · ' + one.title, excerpt(one.text, words));
        item.append(link);
        return item;
    }

    function counted(all, words) {
        if (all.length === 0) return 'Nothing is found.';
        const count = all.length > MOST ? `The first ${MOST} of ${all.length}` : `${all.length} found`;
        return all[0].has < words.length ? `${count}, with ${all[0].has} of ${words.length} words` : count;
    }

    const close = () => { of('site-found').hidden = true; };

    function look() {
        const words = letters(of('site-words').value).split(/\s+/).map((word) => word.replace(/^[^\p{L}\p{N}\/_-]+|[^\p{L}\p{N}\/_#+-]+$/gu, '')).filter(Boolean);
        if (words.length === 0 || pages.length === 0) return close();
        const all = search(words);
        of('site-count').textContent = counted(all, words);
        of('site-found').querySelector('ol').replaceChildren(...all.slice(0, MOST).map((one) => row(one, words)));
        of('site-found').hidden = false;
        of('site-found').scrollTop = 0;
        return undefined;
    }

    /** Arrows go through what is found, Escape back to the words. */
    function key(event) {
        const links = [...of('site-found').querySelectorAll('a')];
        const at = links.indexOf(document.activeElement);
        const typing = document.activeElement === of('site-words');
        if (event.key === 'Escape' && !of('site-found').hidden) {
            event.preventDefault();  // it would empty the field
            close();
            of('site-words').focus();
        } else if ((event.key === 'ArrowDown' || event.key === 'ArrowUp') && (typing || at >= 0) && links.length > 0) {
            event.preventDefault();
            const next = at + (event.key === 'ArrowDown' ? 1 : -1);
            (links[next] ?? (next < 0 ? of('site-words') : links[at])).focus();
        } else if (event.key === '/' && !/^(INPUT|SELECT|TEXTAREA)$/.test(document.activeElement.tagName)) {
            event.preventDefault();
            of('site-words').focus();
        }
    }

    function offerSearch() {
        of('site-search').hidden = false;
        of('site-words').addEventListener('focus', fetchIndex);
        of('site-words').addEventListener('input', () => { fetchIndex(); look(); });
        of('site-search').addEventListener('submit', (event) => {
            event.preventDefault();
            of('site-found').querySelector('a')?.click();
        });
        of('site-found').addEventListener('click', (event) => event.target.closest('a') && close());
        document.addEventListener('keydown', key);
        document.addEventListener('pointerdown', (event) => event.target.closest('#site-found, #site-search') || close());
    }

    /** What is wider than the page is moved by keys, too. */
    function reachable() {
        for (const node of document.querySelectorAll('main pre, main .scroll')) {
            const wide = node.scrollWidth > node.clientWidth;
            if (!wide) { for (const name of ['tabindex', 'role', 'aria-label']) node.removeAttribute(name); continue; }
            node.tabIndex = 0;
            node.setAttribute('role', 'group');
            node.setAttribute('aria-label', node.tagName === 'PRE' ? 'Code' : 'Table');
        }
    }

    dress(remembered());
    document.addEventListener('DOMContentLoaded', () => {
        chooseTheme();
        offerSearch();
        const here = of('site-contents').querySelector('[aria-current]');
        if (here) of('site-contents').scrollTop = here.offsetTop - innerHeight / 2;
    });
    for (const event of ['load', 'resize']) window.addEventListener(event, reachable);
})();
