// Times of Pinocchio's algorithms per call, in ns of processor time: the least of several runs over random states.
// Called by benchmarks/robot_speed.py, which says how it is compiled.
#include <pinocchio/multibody.hpp>
#include <pinocchio/serialization.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <vector>

using namespace pinocchio;

static double seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int argc, char ** argv) {
  if (argc != 2) return 2;
  Model model;
  model.loadFromText(argv[1]);
  Data data(model);
  const int n = 64;
  std::vector<Eigen::VectorXd> q, v, a;
  for (int k = 0; k < n; ++k) {
    Eigen::VectorXd low = Eigen::VectorXd::Constant(model.nq, -1.0), high = Eigen::VectorXd::Constant(model.nq, 1.0);
    q.push_back(randomConfiguration(model, low, high));
    v.push_back(Eigen::VectorXd::Random(model.nv));
    a.push_back(Eigen::VectorXd::Random(model.nv));
  }
  auto time = [&](const char * name, const std::function<void(int)> & call) {
    double best = 1e9;
    for (int trial = 0; trial < 7; ++trial) {
      const int repeats = 20;
      double began = seconds();
      for (int r = 0; r < repeats; ++r)
        for (int k = 0; k < n; ++k) call(k);
      best = std::min(best, (seconds() - began) / (repeats * n));
    }
    std::printf("%s %.1f\n", name, best * 1e9);
  };
  time("forward_dynamics", [&](int k) { aba(model, data, q[k], v[k], a[k]); });
  time("inverse_dynamics", [&](int k) { rnea(model, data, q[k], v[k], a[k]); });
  time("mass_matrix", [&](int k) { crba(model, data, q[k]); });
  time("inverse_dynamics_derivatives", [&](int k) { computeRNEADerivatives(model, data, q[k], v[k], a[k]); });
  time("forward_dynamics_derivatives", [&](int k) { computeABADerivatives(model, data, q[k], v[k], a[k]); });
  return 0;
}
