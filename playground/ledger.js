"use strict";

/** Which true beacon each beacon of the map is: the one that most of its sightings showed. */
class Ledger {
    constructor() {
        this.shown = new Map(); // by uid: sightings by true identity
        this.counts = { right: 0, wrong: 0, new: 0, rejected: 0 };
    }

    identity(uid) {
        const shown = this.shown.get(uid);
        return shown ? [...shown].reduce((best, one) => (one[1] > best[1] ? one : best))[0] : -1;
    }

    /** Books a sighting of the true beacon `id`; what to call it: right, wrong, new or rejected. */
    book(id, account) {
        const verdict = this.verdict(id, account);
        this.counts[verdict] += 1;
        if (account.result === "matched" || account.result === "new") {
            const shown = this.shown.get(account.uid) || new Map();
            this.shown.set(account.uid, shown.set(id, (shown.get(id) || 0) + 1));
        }
        return verdict;
    }

    verdict(id, account) {
        if (account.result === "matched") {
            return !this.shown.has(account.uid) || this.identity(account.uid) === id ? "right" : "wrong";
        }
        return account.result === "new" ? "new" : "rejected";
    }
}
