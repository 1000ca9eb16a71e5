// curves and the scalars that are made of them

#include "verify.h"

void silt_curve_clear(silt_curve *curve) {
    free(curve->x);
    free(curve->y);
    memset(curve, 0, sizeof *curve);
}

void silt_curve_add(silt_curve *curve, double x, double y) {
    SILT_RESERVE(curve->x, curve->capacity_x, curve->n + 1);
    SILT_RESERVE(curve->y, curve->capacity_y, curve->n + 1);
    // kept rising; files are nearly always sorted
    int i = curve->n++;
    for (; i > 0 && curve->x[i - 1] > x; i--) {
        curve->x[i] = curve->x[i - 1];
        curve->y[i] = curve->y[i - 1];
    }
    curve->x[i] = x;
    curve->y[i] = y;
}

double silt_curve_at(const silt_curve *curve, double x) {
    if (curve->n == 0 || !(x >= curve->x[0] && x <= curve->x[curve->n - 1]))
        return NAN;
    int lo = 0, hi = curve->n - 1;
    while (hi - lo > 1) {
        int middle = (lo + hi) / 2;
        *(curve->x[middle] <= x ? &lo : &hi) = middle;
    }
    if (x == curve->x[lo])
        return curve->y[lo];
    if (x == curve->x[hi])
        return curve->y[hi];
    return curve->y[lo] + (curve->y[hi] - curve->y[lo]) * (x - curve->x[lo]) / (curve->x[hi] - curve->x[lo]);
}

double silt_curve_reaches(const silt_curve *curve, double level) {
    double before = NAN;
    for (int i = 0; i < curve->n; i++) {
        const double y = curve->y[i];
        // out of a gap: water comes to where none was
        if (y == level || (i > 0 && isnan(before) && y > level))
            return curve->x[i];
        if (i > 0 && (before - level) * (y - level) < 0)
            return curve->x[i - 1] + (curve->x[i] - curve->x[i - 1]) * (level - before) / (y - before);
        before = y;
    }
    return NAN;
}

// ---------------------------------------------------------------- scalars

// mean over the abscissa by the trapezoidal rule
static double scalar_mean(const silt_curve *c) {
    double sum = 0;
    for (int i = 1; i < c->n; i++)
        sum += 0.5 * (c->y[i] + c->y[i - 1]) * (c->x[i] - c->x[i - 1]);
    double length = c->x[c->n - 1] - c->x[0];
    return length > 0 ? sum / length : c->y[0];
}

// mean distance of the upward crossings of the level, NaN with fewer than two
static double scalar_period(const silt_curve *c, double level) {
    double first = NAN, last = NAN;
    int n = 0;
    for (int i = 1; i < c->n; i++) {
        double a = c->y[i - 1] - level, b = c->y[i] - level;
        if (!(a < 0 && b >= 0))
            continue;
        last = c->x[i - 1] + (c->x[i] - c->x[i - 1]) * a / (a - b);
        first = n++ ? first : last;
    }
    return n > 1 ? (last - first) / (n - 1) : NAN;
}

// least squares, NaN when all abscissas are equal
static double scalar_slope(const silt_curve *c) {
    double mx = 0, my = 0, xx = 0, xy = 0;
    for (int i = 0; i < c->n; i++) {
        mx += c->x[i] / c->n;
        my += c->y[i] / c->n;
    }
    for (int i = 0; i < c->n; i++) {
        xx += silt_square(c->x[i] - mx);
        xy += (c->x[i] - mx) * (c->y[i] - my);
    }
    return xx > 0 ? xy / xx : NAN;
}

static double scalar_extreme(const silt_curve *c, double sign) {
    double best = -HUGE_VAL;
    for (int i = 0; i < c->n; i++)
        best = silt_max(best, sign * c->y[i]);
    return sign * best;
}

// the top of the parabola through a point and its neighbours; an end is taken as it is
static void scalar_top(const silt_curve *c, int i, double *x, double *y) {
    *x = c->x[i];
    *y = c->y[i];
    if (i == 0 || i == c->n - 1)
        return;
    const double l = c->x[i - 1] - c->x[i], r = c->x[i + 1] - c->x[i], yl = c->y[i - 1] - c->y[i],
                 yr = c->y[i + 1] - c->y[i];
    const double det = l * r * (l - r), a = (r * yl - l * yr) / det, b = (l * l * yr - r * r * yl) / det;
    if (!isfinite(a) || a == 0 || fabs(b / (2 * a)) > silt_max(-l, r))
        return;
    *x -= b / (2 * a);
    *y -= b * b / (4 * a);
}

// Rate at which half the distance of successive extrema falls, by least squares of its logarithm. An extremum is taken
// between two crossings of the mean; distances of neighbours do not know where the mean is. NaN with fewer than three.
static double scalar_decay(const silt_curve *c) {
    const double mean = scalar_mean(c);
    silt_curve height = {0};
    double x = NAN, y = NAN, rate = NAN;
    int start = -1; // of the half wave, at its first point behind a crossing
    for (int i = 1; i < c->n; i++) {
        if ((c->y[i - 1] < mean) == (c->y[i] < mean))
            continue;
        if (start >= 0) {
            int best = start;
            double top_x, top_y;
            for (int k = start; k < i; k++)
                if (fabs(c->y[k] - mean) > fabs(c->y[best] - mean))
                    best = k;
            scalar_top(c, best, &top_x, &top_y);
            if (!isnan(x))
                silt_curve_add(&height, 0.5 * (x + top_x), log(0.5 * fabs(top_y - y)));
            x = top_x;
            y = top_y;
        }
        start = i;
    }
    if (height.n > 1)
        rate = -scalar_slope(&height);
    silt_curve_clear(&height);
    return rate;
}

double silt_curve_scalar(const silt_curve *c, const silt_check_def *def) {
    switch (def->scalar) {
    case SCALAR_MAX:
        return scalar_extreme(c, 1);
    case SCALAR_MIN:
        return scalar_extreme(c, -1);
    case SCALAR_MEAN:
        return scalar_mean(c);
    case SCALAR_PERIOD:
        return scalar_period(c, isnan(def->level) ? scalar_mean(c) : def->level);
    case SCALAR_SLOPE:
        return scalar_slope(c);
    case SCALAR_AT:
        return silt_curve_at(c, def->at);
    case SCALAR_REACHES:
        return silt_curve_reaches(c, def->level);
    case SCALAR_AMPLITUDE:
        return 0.5 * (scalar_extreme(c, 1) - scalar_extreme(c, -1));
    case SCALAR_DECAY:
        return scalar_decay(c);
    case SCALAR_LAST:
    case SCALAR_NONE:
        break;
    }
    return c->y[c->n - 1];
}
