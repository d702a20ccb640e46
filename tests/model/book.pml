/* The rules by which one line tells whose a reply is (T2, T8, T10; src/arbiter/outstanding.hpp), for spin.
 *
 * Stations on one wire, requests of clients and proofs, every order of loss, delay and reconnection. A frame shows
 * its station, its function and its form (a length, or the fields that a write echoes), an exception its function
 * alone: two requests that a frame fits cannot be told apart by the frame.
 *
 * P1: whatever is accepted was made for the very request that it answers.   P2: no write is transmitted twice.
 *
 * Time is one assumption (A): what a window waits for has come or never comes when the window ends. Left out:
 * copies (T12), broadcasts (T11), other masters (T9), echoes (T6). Broken on purpose:
 *   -DNO_FORM     a request is sent although its reply looks like an outstanding one
 *   -DNO_FUNCTION ... although an exception could be that to an outstanding request
 *   -DNO_WINDOW   a window ends whenever it likes
 *   -DNO_BOOK     an attempt that ends without its reply is forgotten
 *   -DNO_OLDEST   a refusal is the proof's, whatever else is outstanding
 *   -DNO_AGAIN    the reply to a retry is the retry's, and nothing of its request is outstanding any more
 *   -DNO_ORDER    a reply closes the oldest request that it fits, also where others left over another connection
 *   -DFORGET_OLD  a reconnection forgets what was outstanding
 *   -DRETRY_ALL   a write is repeated like a read
 */
#ifndef REQUESTS
#define REQUESTS 3
#endif
#ifndef ATTEMPTS
#define ATTEMPTS 4
#endif
#ifndef STATIONS
#define STATIONS 1
#endif
#define NONE 7
#define REFUSED 3                       /* the form of an exception: any request of its function */

/* What clients ask. */
byte asked;                             /* requests so far */
byte station[REQUESTS], function[REQUESTS], form[REQUESTS], tries[REQUESTS];
bool writes[REQUESTS], proves[REQUESTS], done[REQUESTS], executed[REQUESTS];

/* Each transmission, in the order in which they leave. */
byte sent;
byte whose[ATTEMPTS], epoch[ATTEMPTS], reply[ATTEMPTS];
mtype = { unsent, travels, answers, gone };
mtype way[ATTEMPTS] = unsent;           /* where it, or its reply, really is */
bool outstanding[ATTEMPTS];             /* what the gateway believes */

byte now_epoch;
byte open = NONE;                       /* the attempt that is waited for */

#define OF(t) whose[t]
#define SAME_STATION(t, q) (station[OF(t)] == station[q])
/* The frame that answers t may answer q. */
#define FITS(t, q) (SAME_STATION(t, q) && function[OF(t)] == function[q] && (reply[t] == REFUSED || reply[t] == form[q]))

bool ok; byte i, oldest;

/* True if nothing outstanding could be taken for the reply to q; of a proof: for its normal reply. */
inline judge_admission(q)
{
    ok = true;
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: outstanding[i] && SAME_STATION(i, q) && function[OF(i)] == function[q] && !(OF(i) == q) ->
            if
#ifndef NO_FUNCTION
            :: !proves[q] || form[OF(i)] == form[q] -> ok = false
#else
            :: form[OF(i)] == form[q] -> ok = false
#endif
            :: else
            fi
        :: else
        fi
    }
#ifdef NO_FORM
    ok = true;
#endif
}

/* The oldest outstanding request that the frame which answers t may answer. */
inline find_oldest(t)
{
    oldest = NONE;
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: oldest == NONE && outstanding[i] && FITS(t, OF(i)) -> oldest = i
        :: else
        fi
    }
}

/* A station serves in order: what left before t on the same connection has been served. */
inline close_before(t)
{
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: i < t && outstanding[i] && SAME_STATION(i, OF(t)) && epoch[i] == epoch[t] && epoch[t] == now_epoch ->
            outstanding[i] = false
        :: else
        fi
    }
}

inline leave_open()
{
#ifndef NO_BOOK
    outstanding[open] = true;
#endif
    open = NONE
}

/* True if what this may answer, the open request included, left over different connections: their order is
   unknown, so nothing is closed before its window ends. */
inline find_two_connections(t)
{
    ok = open != NONE && FITS(t, OF(open)) && epoch[open] != epoch[oldest];
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: outstanding[i] && FITS(t, OF(i)) && epoch[i] != epoch[oldest] -> ok = true
        :: else
        fi
    }
#ifdef NO_ORDER
    ok = false;
#endif
}

inline close_oldest(t)
{
    find_two_connections(t);
    if
    :: !ok -> close_before(oldest); outstanding[oldest] = false
    :: else
    fi
}

inline accept(t)
{
    assert(proves[OF(open)] || OF(t) == OF(open));      /* P1 */
    assert(!writes[OF(open)] || reply[t] == REFUSED || executed[OF(open)]);
    done[OF(open)] = true;
    oldest = NONE;
#ifndef NO_AGAIN
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: oldest == NONE && outstanding[i] && OF(i) == OF(open) -> oldest = i
        :: else
        fi
    }
#endif
    if
    :: oldest != NONE ->                                /* each attempt may have been answered with it */
        close_oldest(t);
        outstanding[open] = true
    :: else -> close_before(open)
    fi;
    open = NONE
}

inline hear(t)
{
    find_oldest(t);
    if
    :: open != NONE && FITS(t, OF(open)) ->
        if
#ifndef NO_OLDEST
        :: reply[t] == REFUSED && oldest != NONE && !(OF(oldest) == OF(open)) -> close_oldest(t)
#endif
        :: else -> accept(t)
        fi
    :: else -> if :: oldest != NONE -> close_oldest(t) :: else fi
    fi
}

/* Nothing older of this station is still on its way: assumption A. */
inline judge_window(t)
{
    ok = true;
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: i <= t && SAME_STATION(i, OF(t)) && way[i] != gone && way[i] != unsent -> ok = false
        :: else
        fi
    }
#ifdef NO_WINDOW
    ok = true;
#endif
}

/* Served in order by its station, on each connection. */
inline judge_turn(t, state)
{
    ok = true;
    for (i : 0 .. ATTEMPTS - 1) {
        if
        :: i < t && SAME_STATION(i, OF(t)) && epoch[i] == epoch[t] && way[i] == state -> ok = false
        :: else
        fi
    }
}

byte q, t;

active proctype line()
{
end:
    do
    /* The wire is free: a new request, or one again. Whose turn it is does not matter here. */
    :: open == NONE && sent < ATTEMPTS -> atomic {
        if
        :: asked < REQUESTS ->
            q = asked; asked++;
            if                                          /* the first is the first, whatever it is called */
            :: q > 0 && STATIONS > 1 -> station[q] = 1
            :: true
            fi;
            if
            :: q > 0 -> form[q] = 1
            :: true
            fi;
            if
            :: writes[q] = true
            :: proves[q] = true
            :: true
            fi;
            if
            :: q > 0 && !writes[q] && !writes[0] -> function[q] = 0
            :: q > 0 -> function[q] = (writes[q] == writes[0] -> 0 : 1)
            :: else
            fi
        :: asked > 0 -> select(q : 0 .. REQUESTS - 1)
        fi;
        if
        :: q < asked && !done[q] && tries[q] < 3 ->
            judge_admission(q);
#ifndef RETRY_ALL
            ok = ok && (tries[q] == 0 || !writes[q]);
#endif
            if
            :: ok ->
                assert(tries[q] == 0 || !writes[q]);    /* P2 */
                tries[q]++;
                whose[sent] = q; epoch[sent] = now_epoch; way[sent] = travels;
                open = sent; sent++
            :: else
            fi
        :: else
        fi; q = 0; i = 0; ok = false }
    /* The gateway waits no longer: sooner or later than the reply. */
    :: open != NONE -> atomic { leave_open() }
    /* A new connection: what is on its way may still come, also behind what comes over the new one. */
    :: now_epoch < 1 && sent > 0 -> atomic {
        now_epoch++;
        if :: open != NONE -> leave_open() :: else fi;
#ifdef FORGET_OLD
        for (i : 0 .. ATTEMPTS - 1) { outstanding[i] = false }
        i = 0
#endif
        }
    /* The end of a window. */
    :: sent > 0 -> atomic {
        select(t : 0 .. ATTEMPTS - 1);
        if
        :: outstanding[t] -> judge_window(t); if :: ok -> outstanding[t] = false :: else fi
        :: else
        fi; t = 0; i = 0; ok = false }
    /* A station, and what is between. */
    :: sent > 0 -> atomic {
        select(t : 0 .. ATTEMPTS - 1);
        if
        :: way[t] == travels ->
            judge_turn(t, travels);
            if
            :: ok -> executed[OF(t)] = true; reply[t] = form[OF(t)]; way[t] = answers
            :: ok -> reply[t] = REFUSED; way[t] = answers
            :: way[t] = gone                            /* lost on its way there */
            fi
        :: way[t] == answers ->
            judge_turn(t, answers);
            if
            :: ok -> hear(t); way[t] = gone
            :: way[t] = gone                            /* lost on its way back, or damaged */
            fi
        :: else
        fi; t = 0; i = 0; ok = false; oldest = NONE }
    od
}
