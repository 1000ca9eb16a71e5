# The case's files from linear theory: the field at the start (mode.csv) and the flow through half of the middle line that grows from
# it (growth.csv), for two layers of depth H in a box of width W with slip walls.
#   w(x, y, t) = cos(k x) sum a_m(t) sin(m pi y/2H), k = pi/W, K^2 = k^2 + (m pi/2H)^2
#   K^2 a_m' = -nu K^4 a_m + 2 g k^2 A/H sin(m pi/2) eta     eta' = w(y = H): the interface, A = (r1 - r2)/(r1 + r2)
# whose growing solution has n^2 = A g k (tanh(kH) - (k/q) tanh(qH)), q^2 = k^2 + n/nu; without viscosity n^2 = A g k tanh(kH).
# The grains start at rest and take the speed of the water at once: what is left of v0 is v0 (r (1 - c) + r)/(r1 + r).
# usage: awk -f modes.awk [-v nu=0.0014 ...]; prints both rates
function sinh(z) { return (exp(z) - exp(-z)) / 2 }
function cosh(z) { return (exp(z) + exp(-z)) / 2 }
function tanh(z) { return sinh(z) / cosh(z) }
BEGIN {
    pi = atan2(0, -1); W = 1; H = 0.5; g = 9.81; r = 1000; rs = 1500; c = 0.0995; v0 = v0 ? v0 : 0.01; nu = nu ? nu : 0.0014
    k = pi / W; r1 = r + c * (rs - r); A = (r1 - r) / (r1 + r)
    n = 1; for (i = 0; i < 99; i++) { q = sqrt(k * k + n / nu); n = sqrt(A * g * k * (tanh(k * H) - k / q * tanh(q * H))) }
    printf "inviscid %.4f /s, viscous %.4f /s\n", sqrt(A * g * k * tanh(k * H)), n

    print "# the mode cos(pi x), " v0 " m/s at the interface y = 0.5 m; written by modes.awk\nx,y,vx,vy" >"mode.csv"
    for (j = 0; j <= 40; j++)
        for (i = 0; i <= 40; i++) {
            z = j / 40 - H; d = H - (z < 0 ? -z : z); side = z < 0 ? -1 : z > 0
            printf "%g,%g,%.6g,%.6g\n", i / 40, j / 40, side * v0 * sin(k * i / 40) * cosh(k * d) / sinh(k * H),
                v0 * cos(k * i / 40) * sinh(k * d) / sinh(k * H) >"mode.csv"
        }

    print "# flow through the left half of the middle line, m2/s, upwards less than 0: linear theory; by modes.awk\ntime,flow" >"growth.csv"
    left = v0 * (r * (1 - c) + r) / (r1 + r); M = 399; dt = 0.0005
    for (m = 1; m <= M; m += 2) { K[m] = k * k + (m * pi / 2 / H) ^ 2; a[m] = 1 / K[m]; s[m] = m % 4 == 1 ? 1 : -1; all += a[m]; }
    for (m = 1; m <= M; m += 2) a[m] *= s[m] * left / all
    for (step = 0; step <= 6000; step++) {
        w = 0
        for (m = 1; m <= M; m += 2) w += a[m] * s[m]
        if (step % 100 == 0) printf "%g,%.6g\n", step * dt, -w / k >"growth.csv"
        eta += dt * w # leapfrog by halves: eta stands at the middle of the steps
        for (m = 1; m <= M; m += 2) {
            e = exp(-nu * K[m] * dt)
            a[m] = a[m] * e + 2 * g * k * k * A / H * s[m] * eta / (nu * K[m] ^ 2) * (1 - e)
        }
    }
}
