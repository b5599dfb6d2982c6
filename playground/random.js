"use strict";

/** Random numbers that a seed decides: mulberry32, by Tommy Ettinger. */
class Random {
    constructor(seed) {
        this.state = seed >>> 0;
    }

    /** In [0, 1). */
    uniform(low = 0, high = 1) {
        this.state = (this.state + 0x6d2b79f5) >>> 0;
        let mixed = Math.imul(this.state ^ (this.state >>> 15), this.state | 1);
        mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
        return low + (high - low) * (((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296);
    }

    /** Normal, mean 0, standard deviation 1, by Box and Muller. */
    normal() {
        const radius = Math.sqrt(-2 * Math.log(1 - this.uniform()));
        return radius * Math.cos(2 * Math.PI * this.uniform());
    }
}
