// pose.c: orientations in space
#include "pose.h"

static void pose_matrix_quaternion(double m[3][3], double q[4]) {
    // the largest of the four first (Shepperd 1978)
    const double trace = m[0][0] + m[1][1] + m[2][2];
    int at = 0;
    double most = trace;
    for (int k = 0; k < 3; k++)
        if (m[k][k] > most) {
            most = m[k][k];
            at = k + 1;
        }
    if (at == 0) {
        q[0] = 0.5 * sqrt(silt_max(0, 1 + trace));
        for (int k = 0; k < 3; k++)
            q[1 + k] = (m[(k + 2) % 3][(k + 1) % 3] - m[(k + 1) % 3][(k + 2) % 3]) / (4 * q[0]);
    } else {
        const int i = at - 1, j = (i + 1) % 3, k = (i + 2) % 3;
        const double root = 0.5 * sqrt(silt_max(0, 1 + m[i][i] - m[j][j] - m[k][k]));
        q[1 + i] = root;
        q[0] = (m[k][j] - m[j][k]) / (4 * root);
        q[1 + j] = (m[j][i] + m[i][j]) / (4 * root);
        q[1 + k] = (m[k][i] + m[i][k]) / (4 * root);
    }
}

void silt_pose_carried(const double from[3][3], const double to[3][3], const double q[4], const double near[4], double out[4]) {
    double m[3][3], turn[4], length = 0, sign = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[i][j] = to[0][i] * from[0][j] + to[1][i] * from[1][j] + to[2][i] * from[2][j];
    pose_matrix_quaternion(m, turn);
    out[0] = turn[0] * q[0] - turn[1] * q[1] - turn[2] * q[2] - turn[3] * q[3];
    for (int k = 0; k < 3; k++) {
        const int i = 1 + (k + 1) % 3, j = 1 + (k + 2) % 3;
        out[1 + k] = turn[0] * q[1 + k] + q[0] * turn[1 + k] + turn[i] * q[j] - turn[j] * q[i];
    }
    for (int k = 0; k < 4; k++) {
        length += out[k] * out[k];
        sign += out[k] * near[k];
    }
    for (int k = 0; k < 4; k++)
        out[k] *= (sign < 0 ? -1 : 1) / sqrt(length);
}

void silt_pose_spin(const double t[6], const double q[4], const double momentum[3], double omega[3]) {
    double l[3];
    silt_turn(q, true, momentum, l);
    // inverse of the symmetric tensor by its cofactors
    const double c[6] = {t[1] * t[2] - t[5] * t[5], t[0] * t[2] - t[4] * t[4], t[0] * t[1] - t[3] * t[3],
                         t[4] * t[5] - t[3] * t[2], t[3] * t[5] - t[4] * t[1], t[3] * t[4] - t[0] * t[5]};
    const double det = t[0] * c[0] + t[3] * c[3] + t[4] * c[4];
    const double w[3] = {(c[0] * l[0] + c[3] * l[1] + c[4] * l[2]) / det, (c[3] * l[0] + c[1] * l[1] + c[5] * l[2]) / det,
                         (c[4] * l[0] + c[5] * l[1] + c[2] * l[2]) / det};
    silt_turn(q, false, w, omega);
}

bool silt_pose_tensor(const double t[6]) {
    // second moments: trace / 2 less the moments; they are as positive as the tensor is real
    const double half = (t[0] + t[1] + t[2]) / 2, m[3] = {half - t[0], half - t[1], half - t[2]}, slack = 1e-9 * half;
    const double a = m[0] + slack, b = a * (m[1] + slack) - t[3] * t[3];
    const double c = a * ((m[1] + slack) * (m[2] + slack) - t[5] * t[5]) + t[3] * (-t[3] * (m[2] + slack) - t[5] * t[4]) -
                     t[4] * (t[3] * t[5] + (m[1] + slack) * t[4]);
    return half > 0 && a >= 0 && b >= 0 && c >= 0;
}
