#include "physics/materials/tangent.h"
namespace lahar {
template <int Dim> Failures one(const Law& law, const double (&H)[Dim][Dim], double dt, bool linear, const double* stress, const double* state, double* out, double* st) {
  LawInput<Dim, Scalar> in; Eigen::Matrix<double,Dim,Dim> h, M;
  for (int a=0;a<Dim;++a) for (int b=0;b<Dim;++b) h(a,b)=H[a][b], in.gradient[a][b]=H[a][b]/dt;
  M = h; if(!linear) M = h*(Eigen::Matrix<double,Dim,Dim>::Identity()+0.5*h).inverse();
  M/=dt; in.dt=dt;
  in.rate[0]=M(0,0); in.rate[1]=M(1,1);
  if constexpr(Dim==2){in.rate[2]=0.0; in.rate[3]=M(0,1)+M(1,0);} else {in.rate[2]=M(2,2); in.rate[3]=M(0,1)+M(1,0); in.rate[4]=M(1,2)+M(2,1); in.rate[5]=M(0,2)+M(2,0);}
  in.volumetric = linear? h.trace() : (Eigen::Matrix<double,Dim,Dim>::Identity()+h).determinant()-1;
  Scalar s[stress_components<Dim>], q[most_state];
  for(int k=0;k<stress_components<Dim>;++k) s[k]=stress[k];
  for(std::size_t k=0;k<most_state;++k) q[k]=state[k];
  Failures f = std::visit([&](const auto& l){ return update(prepare(l), in, s, q); }, law);
  for(int k=0;k<stress_components<Dim>;++k) out[k]=s[k][0];
  for(std::size_t k=0;k<most_state;++k) st[k]=q[k][0];
  return f;
}
template <int Dim> Failures stress_change(const Law& law, const double (&H)[Dim][Dim], double dt, bool linear_strain, const double* stress, const double* state, StressChange<Dim>& to){
  Failures f = one<Dim>(law,H,dt,linear_strain,stress,state,to.stress.data(),to.state.data());
  const double e=1e-7; double st[most_state];
  for(int k=0;k<Dim*Dim;++k){ double up[6],dn[6]; double h[Dim][Dim];
    for(int a=0;a<Dim;++a)for(int b=0;b<Dim;++b)h[a][b]=H[a][b];
    h[k/Dim][k%Dim]+=e; one<Dim>(law,h,dt,linear_strain,stress,state,up,st);
    h[k/Dim][k%Dim]-=2*e; one<Dim>(law,h,dt,linear_strain,stress,state,dn,st);
    for(int r=0;r<stress_components<Dim>;++r) to.tangent[r][k]=(up[r]-dn[r])/(2*e);}
  return f;
}
template Failures stress_change<2>(const Law&, const double (&)[2][2], double, bool, const double*, const double*, StressChange<2>&);
template Failures stress_change<3>(const Law&, const double (&)[3][3], double, bool, const double*, const double*, StressChange<3>&);
}
