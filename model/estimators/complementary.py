"""Draft."""
from __future__ import annotations
import math
from model import ops
from model.estimator import *

class Complementary(Estimator):
    name = "complementary"; summary = ""
    inputs = (Input("dt", -1, 1, "s"),
      *(Input(f"g{k}", -40, 40, "rad/s") for k in "xyz"),
      *(Input(f"m{k}", -1000, 1000, "uT") for k in "xyz"),
      *(Input(f"a{k}", -160, 160, "m/s^2") for k in "xyz"))
    params = tuple(Param(f"{n}_{c}", d, 0, h, "1/s", "") for n, d, h in (("kp", .3, 60), ("ki", .001, 1)) for c in ("pitch","roll","heading")) + (
       Param("declination", 0, -1, 1, "ht", ""), Param("acc_min", 30, 0, 1e4, "", ""), Param("acc_max",300,0,7e4,"",""), Param("gyr_max",34.9,0,40,"",""))
    states = (State("psi",-1,1,"ht"),State("theta",-1,1,"ht"),State("gamma",-1,1,"ht"),
      *(State(f"b_{c}", -.06,.06,"ht/s") for c in ("pitch","roll","heading")),
      State("sg",-1,1,""),State("cg",-1,1,"",1.0),State("st",-1,1,""),State("ct",-1,1,"",1.),State("sec",-100,100,"",1.),State("tan",-100,100,""),
      State("tilt_ok",-1,1,"",-1),State("heading_ok",-1,1,"",-1))
    outputs = tuple(Output(n,u) for n,u in (("psi","ht"),("theta","ht"),("gamma","ht"),("qw",""),("qx",""),("qy",""),("qz",""),("status","")))
    urgent = 3

    def step(self, x, u, p):
        B=ops.bounded; N=ops.named
        r = [B(g*u.dt,-2,2,"rotation per sample") for g in (u.gx,u.gy,u.gz)]
        rx,ry,rz=r
        mx,my,mz=u.mx,u.my,u.mz
        def cross(a,b): return (a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0])
        c=cross(r,(mx,my,mz)); d=cross(r,c)
        m=[a+b+0.5*e for a,b,e in zip((mx,my,mz),c,d)]
        m=[B(a,-2000,2000,"") for a in m]
        mhx = x.cg*m[0]+x.sg*m[2]; mhz= x.cg*m[2]-x.sg*m[0]
        mhy = x.ct*m[1]-x.st*mhz
        mhx=B(mhx,-2000,2000,''); mhy=B(mhy,-2000,2000,'')
        psi_m = ops.atan2_ht(mhx,mhy)
        # predict
        uu = x.sg*rx - x.cg*rz; v = x.cg*rx + x.sg*rz
        dg = B((ry + x.tan*uu)*0.5,-2,2,''); dt_=v*0.5
        sgm = x.sg + dg*(x.cg - dg*x.sg*0.5); cgm = x.cg - dg*(x.sg + dg*x.cg*0.5)
        sec2 = x.sec*x.sec
        tanm = x.tan + dt_*sec2; secm = x.sec + dt_*(x.sec*x.tan)
        tanm=B(tanm,-200,200,''); secm=B(secm,-200,200,'')
        um = sgm*rx - cgm*rz; vm = cgm*rx + sgm*rz
        ipi=1/math.pi
        theta = ops.wrap_ht(x.theta + vm*ipi)
        over = ops.absolute(theta) > 0.5
        gi = B((ry+tanm*um)*ipi,-1,1,''); si=B(secm*um*ipi,-1,1,'')
        h = ops.where(over,1.0,0.0)
        gamma = ops.wrap_ht(x.gamma + gi + h)
        psi_c = x.psi - si + h
        theta = ops.wrap_ht(ops.where(over, 1.0-theta, theta))
        # level
        f2h = u.ax*u.ax+u.az*u.az; f2=f2h+u.ay*u.ay
        gm = ops.atan2_ht(-u.ax,u.az); tm = ops.atan2_ht(u.ay, ops.sqrt(f2h))
        acc_bad = (f2<p.acc_min)|(f2>p.acc_max)
        mh2 = mhx*mhx+mhy*mhy
        mag_bad = mh2 < 1.0
        out={}; nx={}
        restart = u.dt <= 0.0
        res={}
        for c,xp,xm,bad,ok in (("pitch",theta,tm,acc_bad,x.tilt_ok),("roll",gamma,gm,acc_bad,x.tilt_ok),("heading",psi_c,psi_m-p.declination,mag_bad,x.heading_ok)):
            e = ops.wrap_ht((x.psi if c=="heading" else xp) - xm)
            align = (ok<0)|restart
            k = ops.where(bad,0.0,ops.where(align,1.0,getattr(p,"kp_"+c)*u.dt))
            ki= ops.where(bad|align,0.0,getattr(p,"ki_"+c)*u.dt)
            b = x.__dict__["b_"+c]
            nx["b_"+c]=b+ki*e
            res[c]=ops.wrap_ht(xp - k*e - b*u.dt)
            if c!="pitch":
                nx["tilt_ok" if c=="roll" else "heading_ok"]=ops.where(bad, ops.where(restart,-1.0,ok), 0.0)
        psi,theta,gamma=res["heading"],res["pitch"],res["roll"]
        hs=[ops.sincos_ht(a*0.5) for a in (psi,theta,gamma)]
        (s1,c1),(s2,c2),(s3,c3)=hs
        # q = qz(psi) qx(theta) qy(gamma)
        cc,cs,sc,ss=c1*c2,c1*s2,s1*c2,s1*s2   # qz*qx = (cc, cs, ss, sc)
        q=(cc*c3-ss*s3, cs*c3-sc*s3, cc*s3+ss*c3, sc*c3+cs*s3)
        st,ct=2*s2*c2, 1-2*s2*s2
        sg,cg=2*s3*c3, 1-2*s3*s3
        ctc = ops.maximum(ct,0.01)
        sec=B(1.0/B(ctc,0.01,1,''),-100,100,'')
        nx.update(psi=psi,theta=theta,gamma=gamma,sg=sg,cg=cg,st=st,ct=ct,sec=sec,tan=B(st*sec,-100,100,''))
        status = ops.where(acc_bad,1.0/1024,0.0)+ops.where(mag_bad,2.0/1024,0.0)+ops.where(over,4.0/1024,0.0)
        out.update(psi=psi,theta=theta,gamma=gamma,qw=q[0],qx=q[1],qy=q[2],qz=q[3],status=status)
        return nx,out
