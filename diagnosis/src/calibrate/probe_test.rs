#[cfg(test)]
mod t {
    use super::super::*;
    use crate::made_up::HoverGrid;
    use super::super::joint::{self, Data};
    use nalgebra::Vector3;
    #[test]
    fn coverage_probe() {
        let n: u64 = std::env::var("REPEATS").ok().and_then(|s| s.parse().ok()).unwrap_or(50);
        let per: u64 = std::env::var("PER").ok().and_then(|s| s.parse().ok()).unwrap_or(4);
        let truth = [10.11, 0.07668, -5.817];
        let mut hit = [0; 3]; let mut pct=[0;3]; let mut sum=[0.0;3]; let mut sq=[0.0;3]; let mut hw=[0.0;3]; let mut dof=[0.0;3]; let mut se=[0.0;3];
        let t0 = std::time::Instant::now();
        let (mut tg, mut tf) = (0.0, 0.0);
        for rep in 0..n {
            let t1 = std::time::Instant::now();
            let mut recs = Vec::new();
            for (d, name) in ["kolibri","offboard-1","offboard-2","matrice-300"].iter().enumerate() {
                let mut g = HoverGrid::over_one_probe(name).unwrap(); let e=|n:&str,d:f64| std::env::var(n).ok().and_then(|s| s.parse().ok()).unwrap_or(d); g.accuracy_rel=e("GAIN",0.05); g.accuracy_abs_mps=e("ZERO",0.03); g.turbulence=e("TURB",0.12); g.jitter_m=e("JIT",0.01);
                for f in 0..per { let mut r=g.fly(rep*1000 + d as u64*100 + f); let i=&mut r.probes.as_mut().unwrap().instrument; i.accuracy_rel=0.05; i.accuracy_abs_mps=0.03; recs.push(r); }
            }
            tg += t1.elapsed().as_secs_f64();
            let t1 = std::time::Instant::now();
            let o = Options::default();
            let mut g = samples::gather(&recs, &o);
            let cells = cells::cells(&mut g.far, &o);
            let data = Data{flights:&g.flights, samples:&g.far, cells:&cells};
            let j = joint::fit(data, Vector3::new(9.0,0.08,-5.0));
            let u = units::units(data,&j,&o).unwrap();
            let sp = intervals::spread(&u).unwrap();
            tf += t1.elapsed().as_secs_f64();
            if rep==0 { println!("{:?} cells {} conv {} units {} {:?}", g.counts, cells.len(), j.converged, u.units.len(), u.unit); }
            let mut r = crate::random::Random::new(rep);
            let mut draws: Vec<Vec<f64>> = vec![Vec::new();3];
            let n_u=u.units.len();
            for _ in 0..999 { let mut h=nalgebra::Matrix3::zeros(); let mut s=Vector3::zeros();
                for _ in 0..n_u { let x=&u.units[r.index(n_u)]; h+=x.information; s+=x.pull; }
                let d=h.try_inverse().unwrap()*s; for k in 0..3 {draws[k].push(j.constants[k]+d[k]);} }
            for k in 0..3 { let lo=cells::quantile(&mut draws[k],0.025); let hi=cells::quantile(&mut draws[k],0.975); if lo<=truth[k]&&truth[k]<=hi {pct[k]+=1;} }
            for k in 0..3 {
                let i = sp.interval(k, j.constants[k], 0.0);
                if i.low<=truth[k] && truth[k]<=i.high {hit[k]+=1;}
                let e=j.constants[k]-truth[k]; sum[k]+=e; sq[k]+=e*e; hw[k]+=0.5*(i.high-i.low); se[k]+=sp.covariance[(k,k)].sqrt(); dof[k]+=sp.freedom[k];
            }
        }
        for k in 0..3 { let nn=n as f64; let m=sum[k]/nn; println!("pct {:.3}", pct[k] as f64/n as f64); println!("k{k} cover {:.3} bias {:.5} (se {:.5}) sd {:.5} mean half {:.5} se {:.5} dof {:.1}", hit[k] as f64/nn, m, (sq[k]/nn-m*m).sqrt()/nn.sqrt(), (sq[k]/nn-m*m).sqrt(), hw[k]/nn, se[k]/nn, dof[k]/nn); }
        println!("total {:.1} gen {:.1} fit {:.1}", t0.elapsed().as_secs_f64(), tg, tf);
    }
}
