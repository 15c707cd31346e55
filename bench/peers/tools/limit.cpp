// The limit: the workloads written by hand, for this arm alone. Link angles, Cholesky, own polynomials for sine and cosine.
//
// The same source for one double and for several in a vector register (R); -march=native lets the compiler contract a*b + c.
#include "peer.h"

template <int W> struct Wide {
    typedef double R __attribute__((vector_size(8 * W)));
    typedef long long I __attribute__((vector_size(8 * W)));
};
template <> struct Wide<1> {
    typedef double R;
    typedef long long I;
};

template <class R> static inline R splat(double v) { return R{} + v; }
static inline double &lane(double &r, int) { return r; }
template <class R> static inline auto &lane(R &r, int l) { return reinterpret_cast<double *>(&r)[l]; }

// Sine and cosine: reduction by π/2 in two parts, then polynomials that interpolate at Chebyshev points on [-π/4, π/4];
// both below 1e-16 off. Angles of some turns.
template <int W> static inline void sin_cos(typename Wide<W>::R x, typename Wide<W>::R &s, typename Wide<W>::R &c) {
    typedef typename Wide<W>::R R;
    typedef typename Wide<W>::I I;
    const double magic = 6755399441055744.0;
    const R shifted = x * 0.63661977236758134 + magic;
    const R turns = shifted - magic;
    I quadrant;
    memcpy(&quadrant, &shifted, sizeof quadrant);
    const R r = (x - turns * 1.5707963267948966) - turns * 6.123233995736766e-17;
    const R t = r * r;
    R p = splat<R>(1.59179889793974333e-10);
    p = p * t - 2.50511298964501863e-8;
    p = p * t + 2.75573160931984052e-6;
    p = p * t - 1.98412698367405321e-4;
    p = p * t + 8.33333333333093655e-3;
    p = p * t - 1.66666666666666646e-1;
    const R sine = r + r * t * p;
    R q = splat<R>(-1.13825446453492504e-11);
    q = q * t + 2.08761450494131791e-9;
    q = q * t - 2.755731726587808e-7;
    q = q * t + 2.48015872987544012e-5;
    q = q * t - 1.38888888888873898e-3;
    q = q * t + 4.16666666666666654e-2;
    const R cosine = 1.0 + t * (t * q - 0.5);
    const auto swap = (quadrant & 1) != 0;
    const auto negative_sine = (quadrant & 2) != 0;
    const auto negative_cosine = ((quadrant + 1) & 2) != 0;
    s = swap ? cosine : sine;
    c = swap ? sine : cosine;
    s = negative_sine ? -s : s;
    c = negative_cosine ? -c : c;
}

// Moments of the chain, and what resists in its joints.
template <class R> struct Arm {
    R first[3], second[3], coupling[3];  // X_j, J_j, a_1 X_2, a_1 X_3, a_2 X_3
    R weight[3], viscosity, stiffness;
    explicit Arm(R scale) {
        R beyond{};
        for (int j = 2; j >= 0; --j) {
            const R mass = MASS_[j] * scale;
            first[j] = mass * COM_[j] + LENGTH_[j] * beyond;
            second[j] = INERTIA_[j] + mass * (COM_[j] * COM_[j]) + (LENGTH_[j] * LENGTH_[j]) * beyond;
            weight[j] = GRAVITY * first[j];
            beyond += mass;
        }
        coupling[0] = LENGTH_[0] * first[1];
        coupling[1] = LENGTH_[0] * first[2];
        coupling[2] = LENGTH_[1] * first[2];
        viscosity = VISCOSITY * scale;
        stiffness = STIFFNESS * scale;
    }
};

template <class R> struct Trig {
    R s[3], c[3];
};

template <int W> static inline Trig<typename Wide<W>::R> trig(const typename Wide<W>::R link[3]) {
    Trig<typename Wide<W>::R> t;
    for (int j = 0; j < 3; ++j) sin_cos<W>(link[j], t.s[j], t.c[j]);
    return t;
}

// Link accelerations from what acts on the links: everything but the products of speeds and the weight.
template <class R> static inline void accelerate(const Arm<R> &arm, const Trig<R> &t, const R speed[3], const R acting[3], R out[3]) {
    const R c01 = t.c[0] * t.c[1] + t.s[0] * t.s[1], s01 = t.s[0] * t.c[1] - t.c[0] * t.s[1];
    const R c02 = t.c[0] * t.c[2] + t.s[0] * t.s[2], s02 = t.s[0] * t.c[2] - t.c[0] * t.s[2];
    const R c12 = t.c[1] * t.c[2] + t.s[1] * t.s[2], s12 = t.s[1] * t.c[2] - t.c[1] * t.s[2];
    const R h01 = arm.coupling[0] * s01, h02 = arm.coupling[1] * s02, h12 = arm.coupling[2] * s12;
    const R w0 = speed[0] * speed[0], w1 = speed[1] * speed[1], w2 = speed[2] * speed[2];
    const R b0 = acting[0] - arm.weight[0] * t.c[0] - h01 * w1 - h02 * w2;
    const R b1 = acting[1] - arm.weight[1] * t.c[1] + h01 * w0 - h12 * w2;
    const R b2 = acting[2] - arm.weight[2] * t.c[2] + h02 * w0 + h12 * w1;
    // L D Lᵀ with the pivots' inverses from one division.
    const R m01 = arm.coupling[0] * c01, m02 = arm.coupling[1] * c02, m12 = arm.coupling[2] * c12;
    const R d0 = arm.second[0];
    // Multiplied through, so that all pivots share a division: d0, e1 = d0 d1, e2 = e1 d2 (leading minors).
    const R e1 = d0 * arm.second[1] - m01 * m01;
    const R n12 = d0 * m12 - m01 * m02;
    const R f2 = d0 * arm.second[2] - m02 * m02;
    const R e2 = e1 * f2 - n12 * n12;  // d0 times the determinant
    const R inverse = 1.0 / (d0 * e1 * e2);
    const R i2 = inverse * (d0 * e1), i1 = inverse * (d0 * e2), i0 = inverse * (e1 * e2);
    const R y1 = d0 * b1 - m01 * b0;
    const R y2 = e1 * (d0 * b2 - m02 * b0) - n12 * y1;
    out[2] = y2 * i2;
    out[1] = (y1 - n12 * out[2]) * i1;
    out[0] = (b0 - m01 * out[1] - m02 * out[2]) * i0;
}

// One state's right-hand side with spring, viscosity and stiffness.
template <class R> static inline void closed(const Arm<R> &arm, const Trig<R> &t, const R link[3], const R speed[3], R y, R z, R out[3]) {
    const R fy = SPRING * (y - (LENGTH_[0] * t.c[0] + LENGTH_[1] * t.c[1] + LENGTH_[2] * t.c[2]));
    const R fz = SPRING * (z - (LENGTH_[0] * t.s[0] + LENGTH_[1] * t.s[1] + LENGTH_[2] * t.s[2]));
    const R r0 = arm.stiffness * link[0] + arm.viscosity * speed[0];
    const R r1 = arm.stiffness * (link[1] - link[0]) + arm.viscosity * (speed[1] - speed[0]);
    const R r2 = arm.stiffness * (link[2] - link[1]) + arm.viscosity * (speed[2] - speed[1]);
    const R acting[3] = {
        LENGTH_[0] * (fz * t.c[0] - fy * t.s[0]) - r0 + r1,
        LENGTH_[1] * (fz * t.c[1] - fy * t.s[1]) - r1 + r2,
        LENGTH_[2] * (fz * t.c[2] - fy * t.s[2]) - r2,
    };
    accelerate(arm, t, speed, acting, out);
}

// The handle's point with the polynomials above.
static inline void own_handle_at(double time, double duration, double out[2]) {
    const double s = fraction(time, duration);
    double angle = 0.0;
    out[0] = out[1] = 0.0;
    for (int j = 0; j < 3; ++j) {
        double sine, cosine;
        angle += FROM_[j] + s * (TO_[j] - FROM_[j]);
        sin_cos<1>(angle, sine, cosine);
        out[0] += LENGTH_[j] * cosine;
        out[1] += LENGTH_[j] * sine;
    }
}

template <int W> static inline void begin(const double *starts, typename Wide<W>::R link[3]) {
    for (int j = 0; j < 3; ++j)
        for (int l = 0; l < W; ++l) {
            double angle = 0.0;
            for (int i = 0; i <= j; ++i) angle += starts[3 * l + i];
            lane(link[j], l) = angle;
        }
}

// Writes joint angles, lanes side by side; returns where the next go.
template <int W> static inline double *write(const typename Wide<W>::R link[3], double *record) {
    for (int j = 0; j < 3; ++j) {
        auto q = j ? link[j] - link[j - 1] : link[0];
        for (int l = 0; l < W; ++l) *record++ = lane(q, l);
    }
    return record;
}

// Semi-implicit Euler in `substeps` steps from one sample at 50 Hz to the next; `record` gets joint angles, lanes side by side. The handle's
// path from a table, every `every`-th point of which is that of a step, or computed in every step.
template <int W>
static inline void run_euler(const Arm<typename Wide<W>::R> &arm, const double *starts, long substeps, double duration, const double *table, long every, double *record) {
    typedef typename Wide<W>::R R;
    const double h = RECORD * STEP / (double)substeps;
    const long steps = substeps * lround(duration / (RECORD * STEP));
    R link[3], speed[3] = {};
    begin<W>(starts, link);
    for (long i = 0;; ++i) {
        if (i % substeps == 0) record = write<W>(link, record);
        if (i == steps) return;
        double handle[2];
        if (table)
            memcpy(handle, table + 2 * every * i, sizeof handle);
        else
            own_handle_at((double)i * h, duration, handle);
        const Trig<R> t = trig<W>(link);
        R acceleration[3];
        closed(arm, t, link, speed, splat<R>(handle[0]), splat<R>(handle[1]), acceleration);
        for (int j = 0; j < 3; ++j) {
            speed[j] += h * acceleration[j];
            link[j] += h * speed[j];
        }
    }
}

// The same with the step of W2 and W3.
template <int W> static void run(const Arm<typename Wide<W>::R> &arm, const double *starts, double duration, const double *table, double *record) {
    run_euler<W>(arm, starts, RECORD, duration, table, 1, record);
}

// The classical fourth-order method in `substeps` steps from one sample at 50 Hz to the next; the table is of half steps.
template <int W>
static void run_fourth(const Arm<typename Wide<W>::R> &arm, const double *starts, long substeps, double duration, const double *table, double *record) {
    typedef typename Wide<W>::R R;
    const double h = RECORD * STEP / (double)substeps;
    const long steps = substeps * lround(duration / (RECORD * STEP));
    R link[3], speed[3] = {};
    begin<W>(starts, link);
    const auto handle = [&](long half, double out[2]) {
        if (table)
            memcpy(out, table + 2 * half, 2 * sizeof(double));
        else
            own_handle_at(0.5 * h * (double)half, duration, out);
    };
    const auto slope = [&](const R l[3], const R v[3], const double at[2], R out[3]) __attribute__((always_inline)) {
        closed(arm, trig<W>(l), l, v, splat<R>(at[0]), splat<R>(at[1]), out);
    };
    double from[2], middle[2], to[2];
    handle(0, from);
    for (long i = 0, left = 0;; ++i, --left) {
        if (left == 0) {
            record = write<W>(link, record);
            left = substeps;
        }
        if (i == steps) return;
        handle(2 * i + 1, middle);
        handle(2 * i + 2, to);
        R a[4][3], l[3], v[3][3];
        slope(link, speed, from, a[0]);
        for (int j = 0; j < 3; ++j) l[j] = link[j] + 0.5 * h * speed[j], v[0][j] = speed[j] + 0.5 * h * a[0][j];
        slope(l, v[0], middle, a[1]);
        for (int j = 0; j < 3; ++j) l[j] = link[j] + 0.5 * h * v[0][j], v[1][j] = speed[j] + 0.5 * h * a[1][j];
        slope(l, v[1], middle, a[2]);
        for (int j = 0; j < 3; ++j) l[j] = link[j] + h * v[1][j], v[2][j] = speed[j] + h * a[2][j];
        slope(l, v[2], to, a[3]);
        for (int j = 0; j < 3; ++j) {
            link[j] += h * (speed[j] + h / 6.0 * (a[0][j] + a[1][j] + a[2][j]));
            speed[j] += h / 6.0 * (a[0][j] + 2.0 * (a[1][j] + a[2][j]) + a[3][j]);
        }
        memcpy(from, to, sizeof from);
    }
}

enum { LONG_STEPS = 80000, SHORT_STEPS = 8000, LONG_SAMPLES = LONG_STEPS / RECORD + 1, SHORT_SAMPLES = SHORT_STEPS / RECORD + 1 };
static double *starts, *states, long_table[2 * (LONG_STEPS + 1)], short_table[2 * (SHORT_STEPS + 1)];
static double long_record[3 * LONG_SAMPLES], batch_record[8 * 3 * SHORT_SAMPLES];

// The batch; where `all` is given, the angles of every run go there.
template <int W, class Run> static void batch(Run one, double *all) {
    typedef typename Wide<W>::R R;
    for (int i = 0; i < RUNS; i += W) {
        R scale;
        for (int l = 0; l < W; ++l) lane(scale, l) = 1.0 + 1e-4 * (i + l);
        one(Arm<R>(scale), starts + 3 * (1 + i), batch_record);
        for (int k = 0; all && k < 3 * SHORT_SAMPLES; ++k)
            for (int l = 0; l < W; ++l) all[3 * SHORT_SAMPLES * (i + l) + k] = batch_record[W * k + l];
    }
}

template <int W> static void batch_euler(double *all = NULL) {
    batch<W>([](const auto &arm, const double *from, double *to) { run<W>(arm, from, SHORT, short_table, to); }, all);
}

template <int W> static void batch_fine(long substeps, const double *halves, double *all = NULL) {
    batch<W>([=](const auto &arm, const double *from, double *to) { run_euler<W>(arm, from, substeps, SHORT, halves, 2, to); }, all);
}

template <int W> static void batch_fourth(long substeps, const double *table, double *all = NULL) {
    batch<W>([=](const auto &arm, const double *from, double *to) { run_fourth<W>(arm, from, substeps, SHORT, table, to); }, all);
}

// The time of a call, or what it has computed.
#define ANSWER(check, call, values, count)            \
    do {                                              \
        if (check) {                                  \
            call;                                     \
            print_values(values, count);              \
        } else {                                      \
            double seconds_;                          \
            SECONDS_OF(seconds_, call);               \
            printf("{\"seconds\": %.9g}", seconds_);  \
        }                                             \
    } while (0)

// Every fiftieth run, one after another.
static void print_some(const double *all) {
    static double some[RUNS / EVERY][3 * SHORT_SAMPLES];
    for (int i = 0; i < RUNS / EVERY; ++i) memcpy(some[i], all + 3 * SHORT_SAMPLES * EVERY * i, sizeof some[i]);
    print_values(some[0], sizeof some / sizeof(double));
}

// `call` makes the batch; it gets where the angles of every run go, or NULL.
template <class Call> static void answer_batch(int check, Call call) {
    static double all[RUNS * 3 * SHORT_SAMPLES];
    double seconds;
    if (check) {
        call(all);
        print_some(all);
    } else {
        SECONDS_OF(seconds, call(NULL));
        printf("{\"seconds\": %.9g}", seconds);
    }
}

template <int W> static void answer_fourth(int check, long substeps) {
    double *table = half_table(substeps, SHORT);
    answer_batch(check, [=](double *to) { batch_fourth<W>(substeps, table, to); });
    free(table);
}

// W2 and W3 right to an accuracy: `word` without its "accurate:" or "batch:accurate:". False where it is no such task.
static int accurate(int check, const char *word) {
    const Arm<double> arm(1.0);
    const size_t count = 3 * LONG_SAMPLES;
    long substeps;
    if (!strcmp(word, "accurate:euler:80")) {
        ANSWER(check, run<1>(arm, starts, LONG, NULL, long_record), long_record, count);
    } else if (sscanf(word, "accurate:rk4:%ld", &substeps) == 1) {
        ANSWER(check, run_fourth<1>(arm, starts, substeps, LONG, NULL, long_record), long_record, count);
    } else if (sscanf(word, "accurate:rk4_table:%ld", &substeps) == 1) {
        double *table = half_table(substeps, LONG);
        ANSWER(check, run_fourth<1>(arm, starts, substeps, LONG, table, long_record), long_record, count);
        free(table);
    } else if (!strcmp(word, "batch:accurate:euler:80")) {
        answer_batch(check, [](double *to) { batch_euler<4>(to); });
    } else if (sscanf(word, "batch:accurate:fine:%ld", &substeps) == 1) {
        double *halves = half_table(substeps, SHORT);
        answer_batch(check, [=](double *to) { batch_fine<4>(substeps, halves, to); });
        free(halves);
    } else if (sscanf(word, "batch:accurate:rk4_scalar:%ld", &substeps) == 1) {
        answer_fourth<1>(check, substeps);
    } else if (sscanf(word, "batch:accurate:rk4_avx2:%ld", &substeps) == 1) {
        answer_fourth<4>(check, substeps);
    } else if (sscanf(word, "batch:accurate:rk4_avx512:%ld", &substeps) == 1) {
        answer_fourth<8>(check, substeps);
    } else {
        return 0;
    }
    return 1;
}

// Kernels over all states, one call after another.
static double kernel_out[3 * STATES];
template <bool FORWARD> __attribute__((noinline)) static void kernel(const Arm<double> &arm, const double *q, const double *qd, const double *third, double *out) {
    const double link[3] = {q[0], q[0] + q[1], q[0] + q[1] + q[2]}, speed[3] = {qd[0], qd[0] + qd[1], qd[0] + qd[1] + qd[2]};
    const Trig<double> t = trig<1>(link);
    if (FORWARD) {
        const double acting[3] = {third[0] - third[1], third[1] - third[2], third[2]};
        double a[3];
        accelerate(arm, t, speed, acting, a);
        out[0] = a[0], out[1] = a[1] - a[0], out[2] = a[2] - a[1];
    } else {
        const double a[3] = {third[0], third[0] + third[1], third[0] + third[1] + third[2]};
        double on_link[3];
        for (int i = 0; i < 3; ++i) {
            on_link[i] = arm.second[i] * a[i] + arm.weight[i] * t.c[i];
            for (int j = 0; j < 3; ++j)
                if (j != i) {
                    const double m = arm.coupling[i + j - 1];
                    on_link[i] += m * ((t.c[i] * t.c[j] + t.s[i] * t.s[j]) * a[j] + (t.s[i] * t.c[j] - t.c[i] * t.s[j]) * speed[j] * speed[j]);
                }
        }
        out[2] = on_link[2], out[1] = on_link[1] + out[2], out[0] = on_link[0] + out[1];
    }
}
template <bool FORWARD> static void kernels(const Arm<double> &arm) {
    for (int i = 0; i < STATES; ++i)
        kernel<FORWARD>(arm, states + 3 * i, states + 3 * (STATES + i), states + 3 * (2 * STATES + i), kernel_out + 3 * i);
}

// One pass over angles and forces, each in a column of its own: the Gram matrix of 1, the gravity columns of the links and the torques of the joints.
template <int W> static void gram(const double *samples, long count, double out[28]) {
    typedef typename Wide<W>::R R;
    R sums[28] = {};
    for (long i = 0; i + W <= count; i += W) {
        R link[3], fy, fz;
        memcpy(&link[0], samples + i, sizeof(R));
        memcpy(&link[1], samples + count + i, sizeof(R));
        memcpy(&link[2], samples + 2 * count + i, sizeof(R));
        memcpy(&fy, samples + 3 * count + i, sizeof(R));
        memcpy(&fz, samples + 4 * count + i, sizeof(R));
        link[1] += link[0];
        link[2] += link[1];
        const Trig<R> t = trig<W>(link);
        R row[7] = {splat<R>(1.0), GRAVITY * t.c[2], GRAVITY * t.c[1], GRAVITY * t.c[0]};
        row[4] = LENGTH_[2] * (fz * t.c[2] - fy * t.s[2]);
        row[5] = row[4] + LENGTH_[1] * (fz * t.c[1] - fy * t.s[1]);
        row[6] = row[5] + LENGTH_[0] * (fz * t.c[0] - fy * t.s[0]);
        for (int a = 0, k = 0; a < 7; ++a)
            for (int b = a; b < 7; ++b) sums[k++] += row[a] * row[b];
    }
    for (int k = 0; k < 28; ++k) {
        out[k] = 0.0;
        for (int l = 0; l < W; ++l) out[k] += lane(sums[k], l);
    }
}

static double gram_out[28];
template <int W> static void answer_gram(long count) {
    char name[64];
    snprintf(name, sizeof name, "slow%ld.f64", count);
    double *samples = read_doubles(name, 5 * (size_t)count), *columns = (double *)malloc(5 * (size_t)count * sizeof(double)), seconds;
    for (long i = 0; i < count; ++i)
        for (long c = 0; c < 5; ++c) columns[c * count + i] = samples[5 * i + c];
    SECONDS_OF(seconds, gram<W>(columns, count, gram_out));
    printf("{\"seconds\": %.9g}", seconds);
    free(samples);
    free(columns);
}

int main(void) {
    states = read_doubles("states.f64", 9 * STATES);
    starts = read_doubles("starts.f64", 3 * (1 + RUNS));
    for (long i = 0; i <= LONG_STEPS; ++i) handle_at((double)i * STEP, LONG, long_table + 2 * i);
    for (long i = 0; i <= SHORT_STEPS; ++i) handle_at((double)i * STEP, SHORT, short_table + 2 * i);
    const Arm<double> arm(1.0);
    char word[64];
    double seconds;
    while (scanf("%63s", word) == 1) {
        long count;
        if (!strcmp(word, "check:inverse_dynamics")) {
            kernels<false>(arm);
            print_values(kernel_out, 3 * STATES);
        } else if (!strcmp(word, "check:forward_dynamics")) {
            kernels<true>(arm);
            print_values(kernel_out, 3 * STATES);
        } else if (!strcmp(word, "inverse_dynamics")) {
            SECONDS_OF(seconds, kernels<false>(arm));
            printf("{\"seconds\": %.9g}", seconds / STATES);
        } else if (!strcmp(word, "forward_dynamics")) {
            SECONDS_OF(seconds, kernels<true>(arm));
            printf("{\"seconds\": %.9g}", seconds / STATES);
        } else if (!strcmp(word, "check:run")) {
            run<1>(arm, starts, LONG, NULL, long_record);
            print_values(long_record, 3 * LONG_SAMPLES);
        } else if (!strcmp(word, "run")) {
            SECONDS_OF(seconds, run<1>(arm, starts, LONG, NULL, long_record));
            printf("{\"seconds\": %.9g}", seconds);
        } else if (!strcmp(word, "run:table")) {
            SECONDS_OF(seconds, run<1>(arm, starts, LONG, long_table, long_record));
            printf("{\"seconds\": %.9g}", seconds);
        } else if (!strcmp(word, "check:batch")) {
            // The last group of runs; the end of each.
            batch_euler<4>();
            double ends[12];
            for (int l = 0; l < 4; ++l)
                for (int j = 0; j < 3; ++j) ends[3 * l + j] = batch_record[12 * (SHORT_SAMPLES - 1) + 4 * j + l];
            print_values(ends, 12);
        } else if (!strcmp(word, "batch:scalar")) {
            SECONDS_OF(seconds, batch_euler<1>());
            printf("{\"seconds\": %.9g}", seconds);
        } else if (!strcmp(word, "batch:avx2")) {
            SECONDS_OF(seconds, batch_euler<4>());
            printf("{\"seconds\": %.9g}", seconds);
        } else if (!strcmp(word, "batch:avx512")) {
            SECONDS_OF(seconds, batch_euler<8>());
            printf("{\"seconds\": %.9g}", seconds);
        } else if (sscanf(word, "gram:scalar:%ld", &count) == 1) {
            answer_gram<1>(count);
        } else if (sscanf(word, "gram:avx2:%ld", &count) == 1) {
            answer_gram<4>(count);
        } else if (!told_exactly(word) && !accurate(!strncmp(word, "check:", 6), word + (strncmp(word, "check:", 6) ? 0 : 6))) {
            printf("null");
        }
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
