// Pinocchio from C++: headers and library of its Python packages. Compiled without -march=native, because the library was.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <pinocchio/multibody.hpp>

#include "engine.h"

namespace pin = pinocchio;
static pin::Model arm() {
    pin::Model model;
    model.gravity.linear(Eigen::Vector3d(0.0, 0.0, -GRAVITY));
    pin::JointIndex parent = 0;
    for (int j = 0; j < 3; ++j) {
        const pin::SE3 place(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.0, j ? LENGTH_[j - 1] : 0.0, 0.0));
        parent = model.addJoint(parent, pin::JointModelRX(), place, "joint" + std::to_string(j));
        Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
        inertia(0, 0) = INERTIA_[j];
        // Moments about the other axes do not act in a plane; a flat body has these.
        inertia(1, 1) = 0.5 * INERTIA_[j];
        inertia(2, 2) = 0.5 * INERTIA_[j];
        model.appendBodyToJoint(parent, pin::Inertia(MASS_[j], Eigen::Vector3d(0.0, COM_[j], 0.0), inertia), pin::SE3::Identity());
    }
    return model;
}

static const pin::Model model = arm();
static pin::Data data(model);

static void set_up() {}

static void kernels(int forward) {
    typedef Eigen::Map<const Eigen::VectorXd> Map;
    for (int i = 0; i < STATES; ++i) {
        const Map q(states + 3 * i, 3), qd(states + 3 * (STATES + i), 3), third(states + 3 * (2 * STATES + i), 3);
        if (forward)
            pin::aba(model, data, q, qd, third);
        else
            pin::rnea(model, data, q, qd, third);
        memcpy(out + 3 * i, forward ? data.ddq.data() : data.tau.data(), 3 * sizeof(double));
    }
}

// Kinematics, spring at the tip through the Jacobian, articulated bodies.
static const Eigen::VectorXd &accelerations(const Eigen::VectorXd &q, const Eigen::VectorXd &qd, const double handle[2]) {
    static Eigen::VectorXd torque(3);
    pin::forwardKinematics(model, data, q);
    const pin::SE3 &last = data.oMi[3];
    const double y = last.translation()[1] + LENGTH_[2] * last.rotation()(1, 1), z = last.translation()[2] + LENGTH_[2] * last.rotation()(2, 1);
    const double fy = SPRING * (handle[0] - y), fz = SPRING * (handle[1] - z);
    for (int j = 0; j < 3; ++j) {
        // A turn about x moves the tip across the lever.
        const double ly = y - data.oMi[j + 1].translation()[1], lz = z - data.oMi[j + 1].translation()[2];
        torque[j] = ly * fz - lz * fy - VISCOSITY * qd[j] - STIFFNESS * q[j];
    }
    return pin::aba(model, data, q, qd, torque);
}

// Semi-implicit Euler.
static void run() {
    Eigen::VectorXd q = Eigen::Map<Eigen::VectorXd>(starts, 3), qd = Eigen::VectorXd::Zero(3);
    double *to = record;
    for (int i = 0;; ++i) {
        if (i % RECORD == 0) {
            memcpy(to, q.data(), 3 * sizeof(double));
            to += 3;
        }
        if (i == LONG_STEPS) return;
        qd += STEP * accelerations(q, qd, table + 2 * i);
        q += STEP * qd;
    }
}

static int run_by(const char *method, long substeps, const double *halves) {
    if (strcmp(method, "rk4")) return 0;
    const double h = RECORD * STEP / (double)substeps;
    Eigen::VectorXd q = Eigen::Map<Eigen::VectorXd>(starts, 3), v[4] = {Eigen::VectorXd::Zero(3)}, a[4], angle(3);
    for (long k = 0, i = 0; k < LONG_SAMPLES; ++k) {
        for (const long end = k * substeps; i < end; ++i) {
            const double *at = halves + 4 * i;
            a[0] = accelerations(q, v[0], at);
            angle = q + 0.5 * h * v[0], v[1] = v[0] + 0.5 * h * a[0];
            a[1] = accelerations(angle, v[1], at + 2);
            angle = q + 0.5 * h * v[1], v[2] = v[0] + 0.5 * h * a[1];
            a[2] = accelerations(angle, v[2], at + 2);
            angle = q + h * v[2], v[3] = v[0] + h * a[2];
            a[3] = accelerations(angle, v[3], at + 4);
            q += h * (v[0] + h / 6.0 * (a[0] + a[1] + a[2]));
            v[0] += h / 6.0 * (a[0] + 2.0 * (a[1] + a[2]) + a[3]);
        }
        memcpy(record + 3 * k, q.data(), 3 * sizeof(double));
    }
    return 1;
}
