import numpy as np, trimesh, json, os
from scipy.spatial import cKDTree
from body import NAMES, PAR, MIR
d=dict(np.load('body_model.npz')); a=np.load('aux.npz'); V=d['v_template']; F=d['f'].astype(int); mir=a['mir']
def rod(r):
    t=np.linalg.norm(r); 
    if t<1e-12: return np.eye(3)
    k=r/t; K=np.array([[0,-k[2],k[1]],[k[2],0,-k[0]],[-k[1],k[0],0]]); return np.eye(3)+np.sin(t)*K+(1-np.cos(t))*K@K
def forward(pose,betas,trans=np.zeros(3),pd=True):
    vs=V+d['shapedirs']@betas; J=d['J_regressor']@vs; R=np.stack([rod(p) for p in pose.reshape(24,3)])
    vp=vs+(d['posedirs']@(R[1:]-np.eye(3)).reshape(-1) if pd else 0)
    G=np.zeros((24,4,4))
    for j in range(24):
        L=np.eye(4); L[:3,:3]=R[j]; L[:3,3]=J[j]-(J[PAR[j]] if PAR[j]>=0 else 0); G[j]=L if PAR[j]<0 else G[PAR[j]]@L
    A=G.copy(); A[:,:3,3]-=np.einsum('jab,jb->ja',G[:,:3,:3],J)
    T=np.einsum('vj,jab->vab',d['weights'],A); return np.einsum('vab,vb->va',T[:,:3,:3],vp)+T[:,:3,3]+trans, G[:,:3,3]+trans
def vol(v): return (v[F[:,0]]*np.cross(v[F[:,1]],v[F[:,2]])).sum()/6
def selfx(v):
    c=v[F].mean(1); r=np.linalg.norm(v[F]-c[:,None],axis=2).max(1).max(); pr=cKDTree(c).query_pairs(2*r,output_type='ndarray')
    A,B=F[pr[:,0]],F[pr[:,1]]; sh=(A[:,:,None]==B[:,None,:]).any((1,2)); A,B=A[~sh],B[~sh]
    ta,tb=v[A],v[B]; ok=((ta.min(1)<=tb.max(1))&(tb.min(1)<=ta.max(1))).all(1); ta,tb=ta[ok],tb[ok]
    hit=np.zeros(len(ta),bool)
    for P,Q in ((ta,tb),(tb,ta)):
        e1=Q[:,1]-Q[:,0]; e2=Q[:,2]-Q[:,0]
        for i in range(3):
            o=P[:,i]; dd=P[:,(i+1)%3]-o; h=np.cross(dd,e2); det=(e1*h).sum(1); g=np.abs(det)>1e-18; inv=np.where(g,1/np.where(g,det,1),0); s=o-Q[:,0]; u=(s*h).sum(1)*inv; q=np.cross(s,e1); w=(dd*q).sum(1)*inv; t=(e2*q).sum(1)*inv
            hit|=g&(u>=0)&(w>=0)&(u+w<=1)&(t>=0)&(t<=1)
    return int(hit.sum())
if __name__=='__main__':
    m=trimesh.Trimesh(V,F,process=False)
    T=V[F]; ar=.5*np.linalg.norm(np.cross(T[:,1]-T[:,0],T[:,2]-T[:,0]),axis=1)
    l=np.linalg.norm(T-np.roll(T,-1,1),axis=2); q=4*np.sqrt(3)*ar/(l**2).sum(1)
    print('V',len(V),'F',len(F),'watertight',m.is_watertight,'winding',m.is_winding_consistent,'euler',m.euler_number,'vol>0',vol(V)>0,'mass',vol(V)*985,'min area mm2',ar.min()*1e6,'min quality',q.min(),'pct q<.3',(q<.3).mean()*100,'edge mm',l.min()*1e3,l.mean()*1e3,l.max()*1e3)
    print('self-intersections rest',selfx(V),'mirror err',np.abs(V-V[mir]*[-1,1,1]).max(),'W mirror',np.abs(d['weights']-d['weights'][mir][:,MIR]).max(),'W sum',np.abs(d['weights'].sum(1)-1).max(),'max infl',(d['weights']>0).sum(1).max(), 'area m2',ar.sum())
    e=m.edges_unique; dW=np.abs(d['weights'][e[:,0]]-d['weights'][e[:,1]]).max(1); print('max weight jump along edge',dW.max())
    for b in range(10):
        o=[]
        for s in (-2,2):
            be=np.zeros(10); be[b]=s; v=V+d['shapedirs']@be; o.append((s,'mass %.1f'%(vol(v)*985),'H %.3f'%(np.ptp(v[:,1])),'sx',selfx(v)))
        print('beta',b,o)
    rng=np.random.default_rng(7)
    for k in range(6):
        be=rng.normal(size=10); v=V+d['shapedirs']@be; print('rand betas mass %.1f H %.3f sx %d'%(vol(v)*985,np.ptp(v[:,1]),selfx(v)))
    # volume preservation
    for nm,j,ax,deg in (('elbow',18,[0,-1,0],(45,90,120)),('knee',4,[1,0,0],(45,90,120)),('hip flex',1,[-1,0,0],(45,90)),('shoulder adduct',16,[0,0,-1],(45,80)),('wrist twist',20,[1,0,0],(45,90)),('spine1 flex',3,[1,0,0],(30,45))):
        for a_ in deg:
            p=np.zeros((24,3)); p[j]=np.array(ax)*np.radians(a_); v0=forward(p,np.zeros(10),pd=False)[0]; v1=forward(p,np.zeros(10))[0]
            print(nm,a_,'dV lbs %.1f mL, with posedirs %.1f mL'%((vol(v0)-vol(V))*1e6,(vol(v1)-vol(V))*1e6))
    import girth; girth.run(V+a['O'],F)
    Jr=d['J_regressor']@V; L=lambda a_,b_: np.linalg.norm(Jr[NAMES.index(a_)]-Jr[NAMES.index(b_)])/1.70
    print('lengths/H (de Leva): UA %.4f(.1603) FA %.4f(.1535) hand %.4f(.0472) thigh %.4f(.2425) shank %.4f(.249)'%(L('left_shoulder','left_elbow'),L('left_elbow','left_wrist'),L('left_wrist','left_hand'),L('left_hip','left_knee'),L('left_knee','left_ankle')),'height %.4f'%np.ptp(V[:,1]),'J_regressor-J max mm %.3f'%(1e3*np.abs(Jr-d['J']).max()))
    from poses import POSES
    Fa=F; face_arm=d['weights'][F].mean(1)[:,[16,17,18,19]].sum(1)
    for nm,p in POSES.items():
        v0=forward(p,np.zeros(10),pd=False)[0]; v1=forward(p,np.zeros(10))[0]; print('pose %-10s dV lbs %.0f mL, with posedirs %.0f mL, intersecting pairs lbs %d, with posedirs %d'%(nm,(vol(v0)-vol(V))*1e6,(vol(v1)-vol(V))*1e6,selfx(v0),selfx(v1)))
    import posedirs as pdm
    e=np.abs(pdm.make(V,F,d['weights'],d['J'],json.load(open('posedirs.json')))-d['posedirs']).max(); print('posedirs.py remakes posedirs to',e,'nonzero',(d['posedirs']!=0).mean())
    # export float32, and the cross-check through smplx from the float32 values
    z={k:d[k].astype(np.float32) if d[k].dtype.kind=='f' else d[k] for k in d}; np.savez_compressed('body.npz',**z); np.savez_compressed('body-without-posedirs.npz',**{k:z[k] for k in z if k!='posedirs'})
    d.update({k:(z[k].astype(float) if z[k].dtype.kind=='f' else z[k]) for k in z}); V=d['v_template']
    pose=rng.normal(size=(24,3))*.25; be=rng.normal(size=10); tr=np.array([.1,-.2,.3]); v,j=forward(pose,be,tr)
    try:
        import torch, smplx, pickle, types
        os.makedirs('smpl',exist_ok=True); dd={k:d[k] for k in ('v_template','shapedirs','posedirs','J_regressor','weights','kintree_table','f')}; pickle.dump(dd,open('smpl/SMPL_NEUTRAL.pkl','wb'),protocol=2)
        mod=smplx.SMPL('smpl/SMPL_NEUTRAL.pkl',gender='neutral',vertex_ids={'nose':0},dtype=torch.float64)if False else None
        vid={k:0 for k in ['nose','reye','leye','rear','lear','rthumb','rindex','rmiddle','rring','rpinky','lthumb','lindex','lmiddle','lring','lpinky','LBigToe','LSmallToe','LHeel','RBigToe','RSmallToe','RHeel']}
        mod=smplx.create('.',model_type='smpl',gender='neutral',vertex_ids=vid,dtype=torch.float64,num_betas=10)
        t=lambda x: torch.tensor(x,dtype=torch.float64)
        o=mod(betas=t(be)[None],global_orient=t(pose[0])[None],body_pose=t(pose[1:].reshape(1,69)),transl=t(tr)[None])
        sv=o.vertices[0].detach().numpy(); sj=o.joints[0,:24].detach().numpy(); np.savez('crosscheck.npz',pose=pose,betas=be,trans=tr,verts=sv,joints=sj); print('crosscheck.npz written from smplx',smplx.__version__ if hasattr(smplx,'__version__') else '')
        print('smplx parse ok: max|dv|',np.abs(o.vertices[0].detach().numpy()-v).max(),'max|dj|',np.abs(o.joints[0,:24].detach().numpy()-j).max())
    except Exception as ex:
        import traceback; traceback.print_exc()
