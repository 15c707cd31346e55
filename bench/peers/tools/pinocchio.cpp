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

// Kinematics, spring at the tip through the Jacobian, articulated bodies, semi-implicit Euler.
static void run() {
    Eigen::VectorXd q = Eigen::Map<Eigen::VectorXd>(starts, 3), qd = Eigen::VectorXd::Zero(3), torque(3);
    double *to = record;
    for (int i = 0;; ++i) {
        if (i % RECORD == 0) {
            memcpy(to, q.data(), 3 * sizeof(double));
            to += 3;
        }
        if (i == LONG_STEPS) return;
        pin::forwardKinematics(model, data, q);
        const pin::SE3 &last = data.oMi[3];
        const double y = last.translation()[1] + LENGTH_[2] * last.rotation()(1, 1), z = last.translation()[2] + LENGTH_[2] * last.rotation()(2, 1);
        const double fy = SPRING * (table[2 * i] - y), fz = SPRING * (table[2 * i + 1] - z);
        for (int j = 0; j < 3; ++j) {
            // A turn about x moves the tip across the lever.
            const double ly = y - data.oMi[j + 1].translation()[1], lz = z - data.oMi[j + 1].translation()[2];
            torque[j] = ly * fz - lz * fy - VISCOSITY * qd[j] - STIFFNESS * q[j];
        }
        qd += STEP * pin::aba(model, data, q, qd, torque);
        q += STEP * qd;
    }
}
